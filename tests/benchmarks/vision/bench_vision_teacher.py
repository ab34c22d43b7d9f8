"""What one large network of an object's look is worth, beside the tiny ones: pictures kept back, CPU seconds.

python tests/benchmarks/vision/bench_vision_teacher.py builtin:mug builtin:bowl --profile standard --threads 1
python tests/benchmarks/vision/bench_vision_teacher.py FILE.obj --units cm --kind osf --folder kept
python tests/benchmarks/vision/bench_vision_teacher.py builtin:mug --profile smoke --distill --pictures 4
"""

import argparse
import json
import shutil
from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

from rich.console import Console

from harness.authoring.vision.data import held_out_pictures
from harness.authoring.vision.finish_profiles import TeacherFinish
from harness.authoring.vision.metrics import reference_pictures
from harness.authoring.vision.profiles import VisionProfile, vision_profile
from harness.authoring.vision.teacher import made_teacher, teacher_file
from harness.authoring.vision.vision import Teaching, author_vision
from harness.sim.light.appearance_source import appearance_of
from harness.sim.light.direct_image import LitObject

CONSOLE = Console(width=140, highlight=False, emoji=False)


def main() -> None:
    """Measure and print; what was measured already is only printed."""
    parser = argparse.ArgumentParser()
    parser.add_argument("objects", nargs="*", default=["builtin:mug"])
    parser.add_argument("--units", default="m")
    parser.add_argument("--profile", default="standard")
    parser.add_argument("--kind", default="osf-v", choices=("osf-v", "osf"))
    parser.add_argument("--pictures", type=int)
    parser.add_argument("--steps", type=int, help="of the teacher, in place of the profile's")
    parser.add_argument("--finish", type=int, metavar="STEPS", help="of pictures, after the teacher's own")
    parser.add_argument("--slower", type=float, default=TeacherFinish.slower, help="share of rates meanwhile")
    parser.add_argument("--weight", type=float, default=TeacherFinish.weight, help="of what pictures say")
    parser.add_argument("--from-pictures", type=int, default=TeacherFinish.pictures)
    parser.add_argument("--threads", type=int)
    parser.add_argument("--seed", type=int, default=0)
    parser.add_argument("--distill", action="store_true", help="and networks, taught by it and directly")
    parser.add_argument(
        "--folder", type=Path, default=Path("runs/teachers"), help="goes on from what is there"
    )
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    for name in given.objects:
        for word, errors in (compared if given.distill else measured)(name, given).items():
            CONSOLE.print(f"{Path(name).stem:18} {given.kind:6} {word:12} {line(errors)}")


def chosen(given: argparse.Namespace) -> VisionProfile:
    """The profile, with one kind of networks."""
    profile = vision_profile(given.profile)
    if given.kind == "osf":
        size = replace(profile.networks.size, kind="osf")
        profile = replace(profile, networks=profile.strict or replace(profile.networks, size=size))
    return replace(profile, strict=None, pictures=given.pictures or profile.pictures)


def measured(name: str, given: argparse.Namespace) -> Mapping[str, Mapping[str, float]]:
    """The teacher alone, by three ways of drawing its pictures."""
    profile = chosen(given)
    kept = given.folder / f"{Path(name).stem.removeprefix('builtin:')}-{given.kind}-{given.profile}"
    kept = kept.with_name(f"{kept.name}-{given.steps}") if given.steps else kept
    later = f"-{given.finish}-{given.slower:g}-{given.from_pictures}" if given.finish else ""
    told = kept.with_name(f"{kept.name}{later}.json")
    if not told.exists():
        look = appearance_of(name, given.units)
        lit = LitObject(look)
        held_out = held_out_pictures(look.mesh, profile.pictures, profile.side, profile.side, given.seed)
        spec, checkpoint = profile.teacher(given.kind), kept.with_suffix(".npz")
        spec = replace(spec, steps=given.steps or spec.steps, finish=finish_of(given))
        made = made_teacher(lit, held_out, spec, given.seed, checkpoint, unsaid, given.threads)
        references = reference_pictures(lit, held_out, profile.samples)
        errors = made.judged(lit, held_out, references, given.threads)
        told.write_text(json.dumps({**errors, **made.seconds}))
    errors = json.loads(told.read_text())
    ways = {"default": "", "rays 2": "two_rays_", "one sample": "one_sample_"}
    return {way: errors | under(errors, word) for way, word in ways.items()}


def finish_of(given: argparse.Namespace) -> TeacherFinish | None:
    """What the teacher learns from pictures, where that is asked for."""
    if not given.finish:
        return None
    return TeacherFinish(given.from_pictures, steps=given.finish, slower=given.slower, weight=given.weight)


def compared(name: str, given: argparse.Namespace) -> Mapping[str, Mapping[str, float]]:
    """Networks that were taught directly and by the standard teacher, and that teacher."""
    rows: dict[str, Mapping[str, float]] = {}
    stem = f"{Path(name).stem.removeprefix('builtin:')}-{given.kind}"
    profile = replace(chosen(given), teachers=vision_profile("standard").teachers)
    ways: tuple[tuple[str, Teaching], ...] = (("directly", "none"), ("distilled", "distilled"))
    for word, teaching in ways:
        folder = given.folder / f"{stem}-{given.profile}-{word}"
        told, teacher = folder / "errors.json", teacher_file(folder, given.kind)
        folder.mkdir(exist_ok=True)
        kept = given.folder / f"{stem}-standard.npz"
        if kept.exists() and not teacher.exists() and teaching != "none":
            shutil.copy(kept, teacher)
        if not told.exists():
            look = appearance_of(name, given.units)
            made = author_vision(look, profile, given.seed, folder, unsaid, given.threads, teaching)
            told.write_text(json.dumps(dict(made.errors)))
        rows[word] = json.loads(told.read_text())
    return rows | {"teacher": under(rows["distilled"], "teacher_")}


def under(errors: Mapping[str, float], word: str) -> Mapping[str, float]:
    """Those whose names begin with a word, without it."""
    return {name.removeprefix(word): value for name, value in errors.items() if name.startswith(word)}


def unsaid(_what: str, _share: float) -> None:
    """Progress that nobody is told of."""


def line(errors: Mapping[str, float]) -> str:
    """Errors as they are printed, and CPU seconds where a teacher was trained in one go."""
    names = ("psnr_db", "psnr_db_worst", "psnr_db_object", "ssim")
    whole, worst, alone, alike = (errors[name] for name in names)
    stages = ("places", "training", "pictures", "finishing")
    took = [f", {name} {errors[name]:.0f} s of a core" for name in stages if name in errors]
    return f"{whole:6.2f} dB, worst {worst:6.2f}, object alone {alone:6.2f}, ssim {alike:.4f}{''.join(took)}"


if __name__ == "__main__":
    main()

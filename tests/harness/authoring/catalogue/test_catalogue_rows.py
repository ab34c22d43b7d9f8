"""Catalogues as they are published and as people write them: read, filtered, and no row stops another."""

from pathlib import Path

import pytest

from harness.authoring.catalogue.rows import CatalogueRow, of_materials, read_catalogue, with_meshes
from harness.basics.errors import WrongUse
from harness.basics.materials import MATERIALS


def written(folder: Path, text: str, name: str = "objects.csv") -> Path:
    path = folder / name
    path.write_text(text, encoding="utf-8")
    return path


def test_the_published_catalogue_reads_whole(shared_data: Path) -> None:
    found = read_catalogue(shared_data / "meshes" / "objectfolder" / "objects.csv")
    assert len(found.rows) == 1000
    assert found.excluded == ()
    assert sum(row.source is None for row in found.rows) == 28
    assert any("28 objects" in note for note in found.notes)
    counts = {name: len(of_materials(found, [name]).rows) for name in MATERIALS}
    assert counts["wood"] == 622
    assert sum(counts.values()) == 1000
    mug = next(row for row in found.rows if row.name == "025_mug")
    assert (mug.number, mug.scale, mug.material) == ("23", 0.082, "steel")


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        ("2,b,0.1,Cheese,None", "material 'Cheese' is not known"),
        ("2,b,-0.1,Wood,None", "scale_m '-0.1' is no number of m above zero"),
        ("2,b,inf,Wood,None", "scale_m 'inf'"),
        ("2,b,1e999,Wood,None", "scale_m '1e999'"),
        ("2,b,two,Wood,None", "scale_m 'two'"),
        ("2,../b,0.1,Wood,None", "name '../b' cannot name a folder"),
        ("2,,0.1,Wood,None", "name '' cannot name a folder"),
        ("2,b", "material '' is not known"),
        ("2,b,0.1,Wood,http://x,y", "cells"),
    ],
)
def test_a_row_that_cannot_be_is_excluded_by_its_line_and_the_others_stay(
    tmp_path: Path, line: str, reason: str
) -> None:
    found = read_catalogue(written(tmp_path, f"1,a,0.2,wood,None\n\n{line}\n3,c,,STEEL,None\n"))
    assert [row.name for row in found.rows] == ["a", "c"]
    assert found.rows[1].scale is None
    (excluded,) = found.excluded
    assert excluded.reason.startswith("line 3: ")
    assert reason in excluded.reason


def test_names_that_would_share_a_folder_are_excluded(tmp_path: Path) -> None:
    found = read_catalogue(written(tmp_path, "1,Mug,0.1,wood,a\n2,mug,0.1,wood,b\n3,cup,0.1,wood,c\n"))
    assert [row.name for row in found.rows] == ["cup"]
    assert [row.name for row in found.excluded] == ["Mug", "mug"]


def test_a_header_names_columns_in_any_order(tmp_path: Path) -> None:
    text = "\ufeffmaterial,name,wall_m,mass_kg,units,mesh\nglass,vase,0.003,0.4,mm,sub/vase.stl\n"
    (row,) = read_catalogue(written(tmp_path, text)).rows
    assert row == CatalogueRow("vase", "glass", mesh="sub/vase.stl", units="mm", wall=0.003, mass=0.4)
    with pytest.raises(WrongUse, match=r"'matrial'.*'material'"):
        read_catalogue(written(tmp_path, "name,matrial\nvase,glass\n"))


def test_toml_says_the_same_with_units(tmp_path: Path) -> None:
    text = '[[object]]\nname = "vase"\nmaterial = "glass"\nwall = "3 mm"\nmass = "400 g"\nscale = "20 cm"\n'
    (row,) = read_catalogue(written(tmp_path, text, "objects.toml")).rows
    assert row == CatalogueRow("vase", "glass", scale=0.2, wall=0.003, mass=0.4)
    with pytest.raises(WrongUse, match=r"wall.*'3'.*unit"):
        read_catalogue(written(tmp_path, text.replace("3 mm", "3"), "objects.toml"))


@pytest.mark.parametrize(("text", "name"), [("", "a.csv"), ("\n\n", "a.csv"), ("name\n", "a.csv")])
def test_a_catalogue_without_objects_is_wrong_use(tmp_path: Path, text: str, name: str) -> None:
    with pytest.raises(WrongUse, match=name):
        read_catalogue(written(tmp_path, text, name))


def test_a_file_that_is_no_text_is_wrong_use(tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(b"\xff\xfe1,a")
    with pytest.raises(WrongUse, match="UTF-8"):
        read_catalogue(tmp_path / "a.csv")
    with pytest.raises(WrongUse, match=r"b\.csv"):
        read_catalogue(tmp_path / "b.csv")


def test_meshes_are_found_by_name_by_number_and_in_folders_of_their_own(tmp_path: Path) -> None:
    alone, inside = ("Vase.STL", "vase.obj", "7.ply"), ("bowl/textured.obj", "bowl/hull.obj", "pan/x.glb")
    for path in (*alone, *inside, "two/a.obj", "two/b.obj", "sub/deep.obj"):
        (tmp_path / path).parent.mkdir(exist_ok=True)
        (tmp_path / path).touch()
    rows = [
        CatalogueRow("vase", "glass"),
        CatalogueRow("seven", "glass", number="7"),
        CatalogueRow("bowl", "glass"),
        CatalogueRow("pan", "steel"),
        CatalogueRow("two", "steel"),
        CatalogueRow("other", "steel", mesh="sub/deep.obj"),
        CatalogueRow("own", "steel", mesh="builtin:mug"),
        CatalogueRow("none", "steel", mesh="sub/none.obj"),
    ]
    found, excluded = with_meshes(rows, tmp_path)
    assert {row.name: mesh.removeprefix(f"{tmp_path}/") for row, mesh in found} == {
        "vase": "vase.obj",
        "seven": "7.ply",
        "bowl": "bowl/textured.obj",
        "pan": "pan/x.glb",
        "other": "sub/deep.obj",
        "own": "builtin:mug",
    }
    assert [row.name for row in excluded] == ["two", "none"]
    assert all(str(tmp_path) in row.reason for row in excluded)


ROWS = (
    "name{s}material{s}scale_m{s}mass_kg\nbowl{s}ceramic{s}0{d}04{s}0{d}06\nmug{s}steel{s}0{d}04{s}0{d}19\n"
)


@pytest.mark.parametrize("separator", [";", "\t", "|"])
@pytest.mark.parametrize("decimal", [".", ","])
@pytest.mark.parametrize("before", ["", "sep={s}\n", "\n"])
def test_a_spreadsheet_s_separators_are_read_and_stated(
    separator: str, decimal: str, before: str, tmp_path: Path
) -> None:
    text = (before if separator in ";\t" else "") + ROWS
    found = read_catalogue(written(tmp_path, text.format(s=separator, d=decimal)))
    assert [(row.name, row.scale, row.mass) for row in found.rows] == [
        ("bowl", 0.04, 0.06),
        ("mug", 0.04, 0.19),
    ]
    assert not found.excluded
    assert "columns" in found.notes[0]


def test_the_semicolons_of_the_case_are_read() -> None:
    found = read_catalogue(Path(__file__).parents[3] / "samples" / "text_files" / "semi.csv")
    assert [(row.name, row.scale, row.mass) for row in found.rows] == [
        ("bowl", 0.04, 0.06),
        ("mug", 0.04, 0.19),
    ]
    assert "the columns are separated by semicolons" in found.notes


def test_published_rows_with_semicolons_have_their_columns(tmp_path: Path) -> None:
    found = read_catalogue(written(tmp_path, "1;mug;0,2;steel;https://a.example/x,y\n"))
    assert (found.rows[0].name, found.rows[0].scale) == ("mug", 0.2)


@pytest.mark.parametrize("cell", ["1,234", "12,500", "1,2,3", "0,0"])
def test_a_comma_that_may_separate_thousands_is_refused(cell: str, tmp_path: Path) -> None:
    found = read_catalogue(written(tmp_path, f'name,material,scale_m\nmug,steel,"{cell}"\n'))
    assert not found.rows
    assert found.excluded[0].reason.startswith(f"line 2: scale_m '{cell}' ")


def test_a_decimal_comma_in_columns_of_commas_is_refused(tmp_path: Path) -> None:
    found = read_catalogue(written(tmp_path, "name,material,scale_m\nmug,steel,0,04\n"))
    assert "cells" in found.excluded[0].reason


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le"])
@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
def test_a_catalogue_of_any_encoding_and_line_end_is_read(encoding: str, end: str, tmp_path: Path) -> None:
    (tmp_path / "a.csv").write_bytes(ROWS.format(s=",", d=".").replace("\n", end).encode(encoding))
    assert [row.name for row in read_catalogue(tmp_path / "a.csv").rows] == ["bowl", "mug"]


@pytest.mark.parametrize(
    ("text", "said"),
    [
        ("name" + ",x" * 1_000_000, "line 1 .*2,000,004"),
        ("name,material\n" + "a,steel\n" * 200_000, "100,000 lines"),
        (
            "name,material\na," + '"' + "x\n" * 90_000,
            "line 2 .*field larger than field limit",
        ),
        ("name,material,name\na,steel,b\n", "two .*'name'"),
    ],
)
def test_a_hostile_catalogue_is_refused_in_a_sentence(text: str, said: str, tmp_path: Path) -> None:
    with pytest.raises(WrongUse, match=said) as caught:
        read_catalogue(written(tmp_path, text))
    assert len(str(caught.value)) < 300

"""A plate whose modes are written down, struck where a test likes: no mesh is solved for."""

from collections.abc import Sequence

import numpy as np

from experiments.contact_localization.sound.gains import GainTable, gain_table
from harness.basics.arrays import AnyArray, FloatArray
from harness.basics.mesh import Mesh
from harness.bench.acquisition import Strike
from harness.sim.modal.modes import Modes
from harness.sim.solid.surface_samples import Surface, sample_surface

RATE = 50_000.0
LENGTH, WIDTH, THICKNESS = 0.16, 0.11, 0.006
LOWEST_TWIST = 900.0
_CELL = 0.005
_BEFORE = 0.02
_AFTER = 0.35
_ORDERS = ((1, 1), (2, 0), (2, 1), (0, 2), (3, 0), (1, 2), (3, 1), (2, 2), (4, 0), (0, 3), (4, 1), (1, 3))


def box(length: float, width: float, thickness: float, cell: float = _CELL) -> Mesh:
    """A closed box of square-ish faces, so that shapes between its vertices are nearly linear."""
    counts = [max(1, round(size / cell)) for size in (length, width, thickness)]
    axes = [
        np.linspace(-0.5, 0.5, n + 1) * size
        for n, size in zip(counts, (length, width, thickness), strict=True)
    ]
    vertices: list[FloatArray] = []
    faces: list[AnyArray] = []
    for axis in range(3):
        u, v = (axis + 1) % 3, (axis + 2) % 3
        for end in (0, -1):
            grid = np.zeros((len(axes[u]), len(axes[v]), 3))
            grid[..., axis] = axes[axis][end]
            grid[..., u], grid[..., v] = np.meshgrid(axes[u], axes[v], indexing="ij")
            index = np.arange(grid[..., 0].size).reshape(grid.shape[:2]) + sum(map(len, vertices))
            a, b, c, d = index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]
            pair = [np.stack([a, b, c], axis=-1), np.stack([a, c, d], axis=-1)]
            flat = np.concatenate([half.reshape(-1, 3) for half in pair])
            faces.append(flat if end == -1 else flat[:, ::-1])
            vertices.append(grid.reshape(-1, 3))
    return Mesh(np.concatenate(vertices), np.concatenate(faces))


def plate_modes(
    length: float = LENGTH, width: float = WIDTH, scale: float = 1.0, wobble: FloatArray | None = None
) -> Modes:
    """Products of cosines and lines across the plate: orthogonal enough, and known everywhere.

    Args:
        length: m.
        width: m.
        scale: factor on all frequencies.
        wobble: ``(12,)`` further factor on each.
    """
    mesh = box(length, width, THICKNESS)
    mass = 2500.0 * length * width * THICKNESS
    values, frequencies = [], []
    for a, b in _ORDERS:
        values.append(_along(mesh.vertices[:, 0] / length, a) * _along(mesh.vertices[:, 1] / width, b))
        frequencies.append(LOWEST_TWIST * ((a / length) ** 2 + (b / width) ** 2) * LENGTH * WIDTH / 2.0)
    ratios = np.ones(len(_ORDERS)) if wobble is None else wobble
    order = np.argsort(np.array(frequencies) * ratios, kind="stable")
    shapes = np.zeros((len(mesh.vertices), len(order), 3))
    shapes[..., 2] = np.array(values)[order].T / np.sqrt(mass)
    return Modes(
        frequencies=scale * (np.array(frequencies) * ratios)[order],
        points=mesh.vertices,
        normals=mesh.vertex_normals,
        faces=mesh.faces,
        shapes=shapes,
        limit=scale * 20_000.0,
        mass=mass,
        rigid=6,
        nodes=len(mesh.vertices),
        elements=1,
        residual=0.0,
        seconds={},
    )


def _along(share: FloatArray, order: int) -> FloatArray:
    """Of one direction, ``share`` from -0.5 to 0.5: a constant, a line, then a free bar's waves about."""
    if order == 0:
        return np.ones(len(share))
    if order == 1:
        return np.asarray(2.0 * np.sqrt(3.0) * share)
    return np.asarray(np.sqrt(2.0) * np.cos(np.pi * order * (share + 0.5)))


def plate_surface(length: float = LENGTH, width: float = WIDTH, spacing: float = 3.0e-3) -> Surface:
    """Samples of the plate."""
    return sample_surface(box(length, width, THICKNESS), spacing)


def plate_table(modes: Modes, surface: Surface) -> GainTable:
    """The plate's modes at its samples."""
    return gain_table(modes, surface)


def places(count: int, rng: np.random.Generator, step: float = 0.04) -> FloatArray:
    """``(count, 3)`` m: on the upper face, each about ``step`` from the last."""
    found = [rng.uniform(-0.4, 0.4, 2) * (LENGTH, WIDTH)]
    while len(found) < count:
        turn = rng.uniform(0.0, 2.0 * np.pi)
        after = found[-1] + step * np.array([np.cos(turn), np.sin(turn)])
        if np.all(np.abs(after) < 0.45 * np.array([LENGTH, WIDTH])):
            found.append(after)
    flat = np.array(found)
    return np.column_stack([flat, np.full(count, 0.5 * THICKNESS)])


def down(count: int) -> FloatArray:
    """``(count, 3)``: strikes straight onto the upper face."""
    return np.tile(np.array([0.0, 0.0, -1.0]), (count, 1))


def strikes(
    modes: Modes,
    points: FloatArray,
    rng: np.random.Generator,
    gains: AnyArray | None = None,
    noise: float = 0.02,
    contact: Sequence[float] | None = None,
) -> tuple[Strike, ...]:
    """What a microphone hears of strikes at ``(K, 3)`` points, each of another force.

    Args:
        modes: that sound.
        points: m.
        rng: of the noise and the hammer.
        gains: ``(m,)`` complex: how the microphone hears each mode; drawn where None.
        noise: of the pressure, as a share of its greatest value.
        contact: ``(K,)`` s that the hammer touches; drawn about 0.2 ms where None.
    """
    count = len(modes.frequencies)
    heard = rng.normal(size=count) + 1j * rng.normal(size=count) if gains is None else gains
    lasting = rng.uniform(1.6e-4, 2.4e-4, len(points)) if contact is None else contact
    amplitudes = modes.gains(points, down(len(points)))
    return tuple(
        _strike(modes.frequencies, row * heard, touch, noise, rng)
        for row, touch in zip(amplitudes, lasting, strict=True)
    )


def _strike(
    frequencies: FloatArray, amplitudes: AnyArray, contact: float, noise: float, rng: np.random.Generator
) -> Strike:
    first = round(_BEFORE * RATE)
    size = first + round(_AFTER * RATE)
    time = np.arange(size) / RATE
    within = (time >= _BEFORE) & (time < _BEFORE + contact)
    force = np.where(within, 20.0 * np.sin(np.pi * (time - _BEFORE) / contact), 0.0)
    ringing = np.exp((2j * np.pi * frequencies[:, None] - 25.0) * time[None])
    response = np.imag(amplitudes @ ringing)
    padded = 2 * size
    pressure = np.fft.irfft(np.fft.rfft(force, padded) * np.fft.rfft(response, padded), padded)[:size]
    pressure = pressure + noise * np.abs(pressure).max() * rng.normal(size=size)
    force = force + 0.01 * rng.normal(size=size)
    return Strike(RATE, force, pressure, first + 3, 0.0, overload=False, double_hit=False, silent=False)

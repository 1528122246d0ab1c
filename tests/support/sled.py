"""A virtual sled tribometer: pulls of known static and sliding force, written as a machine would export them.

It shares nothing with the readers and trace rules that read its files back; it makes the bundled example and
the campaigns on which the toolkit is tested.
"""

from __future__ import annotations

import csv
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from datetime import datetime, timedelta
from pathlib import Path

import numpy as np

from tribo.records import STANDARD_GRAVITY, FloatArray


@dataclass(frozen=True)
class SledTribometer:
    """A wire-pulled sled on a tensile machine.

    The wire of stiffness ``wire_N_per_m`` is slack for about ``slack_s``, loads the sled linearly at the pull
    speed, lets the force fall to the sliding level within ``fall_s`` and swings in a stick-slip that dies out
    over ``stick_slip_decay_s``. ``noise_N`` is white, ``drift_share`` the slow wander of the sliding force.
    """

    sampling_hz: float = 25.0
    duration_s: float = 16.0
    wire_N_per_m: float = 6000.0
    slack_s: float = 2.0
    fall_s: float = 0.15
    noise_N: float = 0.006
    drift_share: float = 0.003
    stick_slip_share: float = 0.04
    stick_slip_decay_s: float = 3.0

    def pull(
        self, static_N: float, sliding_N: float, speed_m_s: float, rng: np.random.Generator
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Time (s), crosshead travel (m) and force (N), each of shape (n,), of one pull."""
        t = np.arange(0.0, self.duration_s, 1.0 / self.sampling_hz)
        onset = self.slack_s * rng.uniform(0.7, 1.3)
        peak = onset + static_N / (self.wire_N_per_m * speed_m_s)
        rise = np.clip((t - onset) / (peak - onset), 0.0, None) * static_N
        after = np.clip(t - peak, 0.0, None)
        fall = sliding_N + (static_N - sliding_N) * np.exp(-after / self.fall_s)
        swing = self.stick_slip_share * (static_N - sliding_N) * np.exp(-after / self.stick_slip_decay_s)
        saw = 2.0 * np.mod(after / 0.8, 1.0) - 1.0
        wander = self.drift_share * sliding_N * np.sin(2 * np.pi * after / rng.uniform(15.0, 40.0))
        settled = after > 4 * self.fall_s
        force = np.where(t < peak, rise, fall + np.where(settled, swing * saw, 0.0) + wander)
        force = force + rng.normal(0.0, self.noise_N, t.size)
        travel = speed_m_s * t + rng.normal(0.0, 2e-7, t.size)
        return t, travel, force


@dataclass(frozen=True)
class SledLaw:
    """T = mu N + tau0 A of one sample, static and sliding (tau0 in Pa)."""

    static_mu: float
    static_tau0_Pa: float
    sliding_mu: float
    sliding_tau0_Pa: float

    def forces_N(self, normal_load_N: float, nominal_area_m2: float) -> tuple[float, float]:
        """Static and sliding friction force at a normal load."""
        return (
            self.static_mu * normal_load_N + self.static_tau0_Pa * nominal_area_m2,
            self.sliding_mu * normal_load_N + self.sliding_tau0_Pa * nominal_area_m2,
        )


@dataclass(frozen=True)
class SledDesign:
    """What is pulled: samples, loads, specimens and repeats, in an order drawn at random.

    With ``holds_s`` the time at rest of each pull is drawn from them. ``ageing`` multiplies the static force by a
    factor of that time.
    """

    laws: Mapping[str, SledLaw]
    masses_g: Sequence[float] = (5.0, 25.0, 50.0, 138.5)
    specimens: int = 3
    repeats: int = 2
    slider_mass_g: float = 1.5
    nominal_area_mm2: float = 55.0
    speed_mm_s: float = 0.2
    hold_s: float = 10.0
    holds_s: Sequence[float] = ()
    ageing: Callable[[float], float] = field(default=lambda _: 1.0)
    specimen_scatter: float = 0.04
    repeat_scatter: float = 0.03
    tribometer: SledTribometer = field(default_factory=SledTribometer)


def as_bluehill(test_id: str, t: FloatArray, travel: FloatArray, force: FloatArray) -> bytes:
    """Instron Bluehill: quoted, comma, CRLF, units in brackets on a second header row."""
    head = f'"Specimen label","{test_id}"\r\n\r\n"Time","Extension","Load"\r\n"(s)","(mm)","(N)"\r\n'
    rows = (
        f'"{a:.3f}","{b:.4f}","{c:.4f}"\r\n' for a, b, c in zip(t, travel * 1e3, force, strict=True)
    )
    return (head + "".join(rows)).encode("ascii")


def as_testxpert(test_id: str, t: FloatArray, travel: FloatArray, force: FloatArray) -> bytes:
    """ZwickRoell testXpert in German: semicolon, decimal comma, ISO-8859-1, millinewton."""
    head = f'"Prüfprotokoll";"{test_id}"\r\n"Prüfzeit";"Standardweg";"Standardkraft"\r\n"s";"mm";"mN"\r\n'
    rows = (
        f"{a:.3f};{b:.4f};{c:.2f}".replace(".", ",") + "\r\n"
        for a, b, c in zip(t, travel * 1e3, force * 1e3, strict=True)
    )
    return (head + "".join(rows)).encode("latin-1")


def as_delimited(test_id: str, t: FloatArray, travel: FloatArray, force: FloatArray) -> bytes:
    """A home-made logger: comment line, names with units in brackets, gram-force, micrometre, millisecond."""
    head = f"# {test_id}\nFx (gf),Displacement (um),Time (ms)\n"
    gram_force = force / (STANDARD_GRAVITY * 1e-3)
    rows = (
        f"{c:.3f},{b:.1f},{a:.1f}\n" for a, b, c in zip(t * 1e3, travel * 1e6, gram_force, strict=True)
    )
    return (head + "".join(rows)).encode("ascii")


EXPORTERS: dict[str, Callable[[str, FloatArray, FloatArray, FloatArray], bytes]] = {
    "bluehill": as_bluehill,
    "testxpert": as_testxpert,
    "delimited": as_delimited,
}


def _pattern_and_direction(sample: str) -> tuple[str, str]:
    return (sample[:-1], sample[-1]) if len(sample) > 1 and sample[-1] in "xy" else (sample, "")


def _planned_pulls(design: SledDesign, rng: np.random.Generator) -> list[tuple[str, int, float, int]]:
    plan = [
        (sample, specimen, mass, repeat)
        for sample in design.laws
        for specimen in range(1, design.specimens + 1)
        for mass in design.masses_g
        for repeat in range(1, design.repeats + 1)
    ]
    return [plan[k] for k in rng.permutation(len(plan))]


def write_campaign(
    folder: Path, design: SledDesign, campaign_toml: str, *, dialect: str = "bluehill", seed: int = 0
) -> None:
    """Write a whole campaign (campaign.toml, tests.csv, raw/) of the virtual tribometer into ``folder``.

    Specimens differ by a gain of relative spread ``specimen_scatter`` (one gain per specimen, static and
    sliding alike), repeats by ``repeat_scatter``. The same seed gives the same bytes.

    Raises
    ------
    KeyError
        ``dialect`` is not one of EXPORTERS.
    """
    export = EXPORTERS[dialect]
    rng = np.random.default_rng(seed)
    (folder / "raw").mkdir(parents=True, exist_ok=True)
    (folder / "campaign.toml").write_text(campaign_toml, encoding="utf-8")
    gains: dict[str, float] = {}
    start = datetime(2026, 3, 2, 9, 0)
    rows = []
    for order, (sample, number, mass_g, repeat) in enumerate(_planned_pulls(design, rng), start=1):
        pattern, direction = _pattern_and_direction(sample)
        specimen = f"{pattern}{number}"
        gain = gains.setdefault(specimen, float(rng.normal(1.0, design.specimen_scatter)))
        load_N = (mass_g + design.slider_mass_g) * 1e-3 * STANDARD_GRAVITY
        forces = design.laws[sample].forces_N(load_N, design.nominal_area_mm2 * 1e-6)
        static_N, sliding_N = (f * gain * rng.normal(1.0, design.repeat_scatter) for f in forces)
        hold_s = float(rng.choice(design.holds_s)) if design.holds_s else design.hold_s
        static_N *= design.ageing(hold_s)
        test_id = f"T{order:03d}"
        signals = design.tribometer.pull(
            max(static_N, sliding_N), sliding_N, design.speed_mm_s * 1e-3, rng
        )
        (folder / "raw" / f"{test_id}.csv").write_bytes(export(test_id, *signals))
        rows.append(
            {
                "test_id": test_id,
                "file": f"raw/{test_id}.csv",
                "sample": sample,
                "specimen": specimen,
                "direction": direction,
                "mass_g": f"{mass_g:g}",
                "speed_mm_s": f"{design.speed_mm_s:g}",
                "hold_s": f"{hold_s:g}",
                "repeat": repeat,
                "run_order": order,
                "started_at": (start + timedelta(minutes=8 * (order - 1))).isoformat(),
                "temperature_C": f"{rng.normal(23.0, 0.7):.1f}",
                "humidity_pct": f"{rng.normal(51.0, 1.5):.1f}",
            }
        )
    with (folder / "tests.csv").open("w", newline="", encoding="utf-8") as out:
        writer = csv.DictWriter(out, fieldnames=list(rows[0]), lineterminator="\n")
        writer.writeheader()
        writer.writerows(rows)

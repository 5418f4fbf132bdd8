"""The stability suite: its figures within the stored bounds, remedies that help, the report, and the commands that show a failure.

Every figure is the same for the same seed, so no test here is left to luck. The bounds of techniques that sample at random lie at
least five standard deviations, over bakes with several seeds, above the mean figure: a change that only draws other numbers passes
with a confidence of more than 99.9 %, also over all figures together.
"""

import json
from dataclasses import replace

import numpy as np
import pytest

from rtgi_addon.errors import BakeError, Cancelled, UsageError
from rtgi_addon.evaluate import stability
from rtgi_addon.evaluate.stability import (
    ABOVE,
    CASES,
    HOLDS,
    WEAK,
    WORSE,
    Case,
    Limit,
    Result,
    Sample,
    Variant,
    limits,
    own,
    parts,
    suite,
)
from rtgi_addon.evaluate.stability.motion import flicker
from rtgi_addon.evaluate.stability.own import OWN_NAMES, own_cases
from rtgi_addon.jobs.stability import run_stability
from rtgi_addon.progress import Progress
from rtgi_addon.scene import World
from rtgi_addon.storage.png import write_png
from rtgi_addon.storage.workplace import partial_of
from rtgi_addon.techniques import names

# What takes about a second; the others are marked slow.
FAST = {
    "wall-thickness": ("vpl", "rsm", "lpv"), "leak-feedback": ("lpv",), "baffle": ("probes", "vpl", "rsm", "lpv"),
    "lattice-on-walls": ("lpv",), "degenerate-mesh": ("rsm",), "refusal": ("probes", "vpl", "rsm", "lpv"), "scale": ("rsm",),
    "edge-bias": ("rsm",), "near-one-albedo": ("rsm", "lpv"), "lone-plate": ("probes", "vpl", "rsm", "lpv"),
    "spreading": ("probes", "vpl", "rsm", "lpv"), "resolution": ("probes", "vpl", "rsm"), "step-size": ("rsm", "lpv"),
    "fireflies": ("rsm",), "media-steps": ("probes",), "media-thin": ("probes",),
    "reflection-pan": ("screen_reflections",), "reflection-thickness": ("screen_reflections",),
    "reflection-furnace": ("screen_reflections",),
}
FIGURES = [pytest.param(case.name, technique, marks=() if technique in FAST.get(case.name, ()) else pytest.mark.slow)
           for case, technique in stability.chosen()]
# Remedies, and to what share of it they must bring the figure: (case, technique, what is left out instead, share).
REMEDIES = [("wall-thickness", "probes", "plain trilinear", 0.01), ("wall-thickness", "lpv", "without blocking", 0.05),
            ("lattice-on-walls", "probes", "without virtual offset, bias and lift", 0.1),
            # Weights' common floor of 1e-4 had smoothed that to 0.81, and let light into dark rooms' corners.
            ("probe-in-geometry", "probes", "without virtual offset", 0.92),
            ("fireflies", "vpl", "bound at the mean irradiance", 0.5), ("fireflies", "vpl", "no clamp", 0.2),
            ("light-motion", "vpl", "virtual lights sampled anew each frame", 0.8)]


@pytest.mark.parametrize(("name", "technique"), FIGURES)
def test_figures_stay_within_their_bounds(name, technique):
    result = stability.measure(CASES[name], technique)
    assert result.verdict != WORSE, (f"{name} of {technique} is {result.figure:.4g} at {result.worst.parameter}, and its bound is "
                                     f"{result.limit.bound:g}; see it with: {result.command}")


@pytest.mark.slow
@pytest.mark.parametrize(("name", "technique", "without", "share"), REMEDIES)
def test_remedies_help(name, technique, without, share):
    case = CASES[name]
    (variant,) = (variant for variant in case.variants[technique] if variant.name == without)
    before, after = stability.measure(case, technique, variant).figure, stability.measure(case, technique).figure
    assert after < share * before


def test_shadow_rays_keep_reflective_shadow_maps_behind_the_wall():
    case = CASES["baffle"]
    (variant,) = (variant for variant in case.variants["rsm"] if variant.remedy)
    assert stability.measure(case, "rsm", variant).figure == 0.0
    assert stability.measure(case, "rsm").verdict == WEAK


def test_every_technique_is_in_the_suite_and_every_weakness_has_a_reason():
    effects = {"ray_traced", "screen_reflections"}
    assert {technique for case in CASES.values() for technique in case.limits} == set(names()) | effects
    assert set(limits.LIMITS) == set(CASES)
    for case in CASES.values():
        assert set(case.variants) <= set(case.limits)
        for technique, limit in case.limits.items():
            assert np.isfinite(limit.bound) and (limit.bound <= case.goal or limit.why), (case.name, technique)


def test_steady_motion_is_no_flicker():
    time = np.arange(6.0)[:, None]
    assert flicker(2.0 + time * np.array([[0.1, -0.2, 0.0]])) < 1e-12
    rng = np.random.default_rng(3)
    # 6 frames of 4,000 points: the estimate's own error is 0.6 %, the bound five times that.
    assert flicker(1.0 + 0.1 * rng.standard_normal((6, 4000))) == pytest.approx(0.1, rel=0.03)


def test_receivers_lie_on_the_walls_and_face_inward():
    points, normals = parts.receivers((-1, -2, 0), (1, 2, 3), 3)
    middle = np.array([0.0, 0.0, 1.5])
    assert points.shape == (54, 3) and np.all(np.einsum("ij,ij->i", middle - points, normals) > 0)
    on_wall = np.isclose(points, [-1, -2, 0]) | np.isclose(points, [1, 2, 3])
    assert np.all(on_wall.sum(axis=1) == 1)


@pytest.fixture
def made_up(monkeypatch):
    """A case that measures nothing: 0.1 for probes, 0.5 for rsm and infinity for lpv; a variant has 0.9."""
    def measure(bench):
        value = 0.9 if bench.settings else {"probes": 0.1, "rsm": 0.5, "lpv": np.inf}[bench.technique]
        return [Sample("first", 0.0), Sample("second", value)]

    case = Case("made-up", "nothing fails", "no scene", "a number", "two steps", 0.2, measure,
                {"probes": (Variant("left out", {"rays": 64}),)})
    monkeypatch.setitem(limits.LIMITS, "made-up", {"probes": Limit(0.2), "rsm": Limit(0.6, "it is like that"), "lpv": Limit(1.0)})
    monkeypatch.setitem(suite.CASES, "made-up", case)
    return case


def test_verdicts(made_up):
    found = [stability.measure(made_up, technique).verdict for technique in ("probes", "rsm", "lpv")]
    assert found == [HOLDS, WEAK, WORSE]
    assert Result(made_up, "probes", (Sample("only", float("nan")),), 0.0).verdict == WORSE
    assert stability.measure(made_up, "rsm").worst.parameter == "second"


def test_the_report_names_figures_reasons_and_commands(made_up, tmp_path):
    report = run_stability(tmp_path / "out", cases=["made-up"])
    text, data = (tmp_path / "out/stability.md").read_text(), json.loads((tmp_path / "out/stability.json").read_text())
    for words in ("made-up", "it is like that", "| lpv | infinite | 1 | worse", "| probes | instead: left out | 0.9 | 0.1 |",
                  "stability --case made-up --technique rsm"):
        assert words in text, words
    assert [entry["verdict"] for entry in data["cases"]] == [HOLDS, WEAK, WORSE]
    assert data["cases"][2]["figure"] is None and data["cases"][0]["samples"][1] == {"parameter": "second", "value": 0.1}
    assert data["variants"][0]["figure"] == 0.9 and data["complete"]
    assert [result.technique for result in report.worse] == ["lpv"] and "1 worse" in report.to_text()


def test_a_cancelled_run_keeps_what_was_measured(made_up, tmp_path):
    progress = Progress()
    measure = made_up.measure

    def measure_and_cancel(bench):
        if bench.technique == "rsm":
            progress.cancel()
        return measure(bench)

    object.__setattr__(made_up, "measure", measure_and_cancel)
    with pytest.raises(Cancelled, match="what was measured is in"):
        run_stability(tmp_path, cases=["made-up"], variants=False, progress=progress)
    data = json.loads((tmp_path / "stability.json").read_text())
    assert not data["complete"] and [entry["technique"] for entry in data["cases"]] == ["probes", "rsm"]
    asked = []
    object.__setattr__(made_up, "measure", lambda bench: asked.append(bench.technique) or measure(bench))
    report = run_stability(tmp_path, cases=["made-up"], variants=False, resume=True)
    assert asked == ["lpv"] and [result.verdict for result in report.results] == [HOLDS, WEAK, WORSE]
    assert [result.worst.parameter for result in report.results] == ["second"] * 3
    assert json.loads((tmp_path / "stability.json").read_text())["complete"] and not partial_of(tmp_path).exists()
    # A whole report stays until there is another one.
    before = (tmp_path / "stability.json").read_bytes()
    object.__setattr__(made_up, "measure", measure_and_cancel)
    progress = Progress()
    with pytest.raises(Cancelled, match=r"is in .*\.partial, the report in .* is the earlier one"):
        run_stability(tmp_path, cases=["made-up"], variants=False, progress=progress)
    assert (tmp_path / "stability.json").read_bytes() == before and partial_of(tmp_path).exists()


def test_the_worst_case_is_drawn(tmp_path):
    report = run_stability(tmp_path, cases=["baffle"], techniques=["lpv"], variants=False)
    assert report.pictures == {("baffle", "lpv"): "pictures/baffle-lpv.png"}
    picture = tmp_path / "pictures/baffle-lpv.png"
    assert picture.read_bytes().startswith(b"\x89PNG") and picture.stat().st_size > 2000
    assert "](pictures/baffle-lpv.png)" in (tmp_path / "stability.md").read_text()


def test_pictures_outlive_an_interruption(made_up, tmp_path, monkeypatch):
    progress = Progress()

    def draw(result, path):
        if result.technique == "rsm":
            progress.cancel()
        return write_png(path, np.full((2, 2, 3), len(result.technique), np.uint8))

    monkeypatch.setattr("rtgi_addon.jobs.stability.draw_result", draw)
    with pytest.raises(Cancelled):
        run_stability(tmp_path / "whole", cases=["made-up"], progress=progress)
    run_stability(tmp_path / "out", cases=["made-up"])
    run_stability(tmp_path / "whole", cases=["made-up"], resume=True)
    for name in ("probes", "rsm", "lpv"):
        assert (tmp_path / f"whole/pictures/made-up-{name}.png").read_bytes() == \
            (tmp_path / f"out/pictures/made-up-{name}.png").read_bytes()


@pytest.mark.parametrize(("cases", "techniques", "word"), [
    (["no-such"], None, "no-such"), (None, ["no-such"], "no-such"), (["camera-dolly"], ["probes"], "camera-dolly")])
def test_unknown_names_are_refused_before_anything_is_measured(tmp_path, cases, techniques, word):
    with pytest.raises(UsageError, match=word):
        run_stability(tmp_path / "out", cases=cases, techniques=techniques)
    assert not (tmp_path / "out").exists()


# ---- a user's own scene

@pytest.fixture(scope="module")
def small_room():
    return replace(parts.room_with_block(3), source="room.blend")


def test_an_own_scene_names_its_cases_and_leaves_out_lamps_where_there_are_none(small_room):
    assert tuple(own_cases(small_room)) == OWN_NAMES
    dark = replace(small_room, lights=(), world=World.constant(1.0))
    assert set(OWN_NAMES) - set(own_cases(dark)) == {"lamp-motion"}


@pytest.mark.parametrize(("name", "technique"), [("phase", "lpv"), ("rotation", "lpv"), ("seeds", "rsm"), ("size", "lpv"),
                                                 ("lamp-motion", "rsm"), ("energy", "lpv"), ("leaks", "rsm"),
                                                 pytest.param("refinement", "probes", marks=pytest.mark.slow)])
def test_an_own_scene_is_measured(small_room, name, technique):
    result = stability.measure(own_cases(small_room)[name], technique)
    assert np.isfinite(result.figure) and result.figure >= 0
    assert result.verdict == (HOLDS if result.figure <= result.case.goal else ABOVE)
    assert result.command.startswith('python -m rtgi_addon "room.blend" stability --case ' + name)


def test_size_does_not_matter_and_light_volumes_leak_more_than_virtual_lights(small_room):
    cases = own_cases(small_room)
    assert stability.measure(cases["size"], "lpv").figure < 0.002
    assert stability.measure(cases["leaks"], "lpv").figure > stability.measure(cases["leaks"], "vpl").figure


def test_a_volume_that_no_surface_lies_in_is_not_said_to_hold(small_room):
    """Receivers are those that its probes see, all of them outside it: moving the lattice then tells nothing."""
    floating = replace(small_room, volumes=(parts.volume((-0.9, 0.5, 0.2), (-0.5, 0.9, 0.6), (2, 2, 2)),))
    result = stability.measure(own_cases(floating)["phase"], "lpv")
    assert result.verdict == ABOVE and result.worst.parameter.startswith("nothing was measured")


def test_what_refuses_an_own_scene_is_reported_and_the_rest_goes_on(small_room, tmp_path, monkeypatch):
    def refuse(*_args, **_kwargs):
        raise BakeError("this technique will not", "choose another")

    monkeypatch.setattr(own, "find_leaks", refuse)
    report = run_stability(tmp_path, small_room, cases=["leaks", "size"], techniques=["rsm"], pictures=False)
    assert report.results[0].worst.parameter == "refused: this technique will not"
    assert report.results[0].verdict == ABOVE and np.isfinite(report.results[1].figure)
    text = report.to_markdown()
    assert "visibility=true" in text and "infinite" in text and not report.worse


def test_every_kind_of_lamp_keeps_its_light_under_a_similarity():
    """The irradiance that a lamp gives grows with no size: intensity with its square, radiance not at all."""
    from rtgi_addon.scene import AreaLight, SpotLight
    from rtgi_addon.transport.context import LightContext
    from rtgi_addon.transport.paths.direct import Receiver, lamp_irradiance
    down, half = np.float32([0, 0, -1]), np.float32([0.2, 0, 0])
    lamps = (AreaLight("area", np.float32([0.3, 0, 0.9]), half, np.float32([0, 0.2, 0]), down, np.full(3, 2.0, np.float32)),
             SpotLight("spot", np.float32([-0.4, 0, 0.8]), down, np.full(3, 3.0, np.float32), 1.2, 0.3, radius=0.05,
                       world_from_local=np.diag([1.0, 0.5, 1.0])))
    built = replace(parts.room_with_block(2), lights=lamps)
    turn = parts.rotation((0.3, 0.5, 1.0), 40.0)
    grown = turn @ np.diag([7.0, 7.0, 7.0, 1.0])
    points, normals = (np.repeat(part, 64, axis=0) for part in parts.receivers(-parts.ONE, parts.ONE, 4))
    points = points + np.float32(1e-3) * normals
    u = np.random.default_rng(1).random((len(points), 3), dtype=np.float32)

    def lit(taken, points, normals):
        return lamp_irradiance(LightContext(taken), points, Receiver(normals, normals), u)

    before = lit(built, points, normals)
    after = lit(parts.moved(built, grown, intensity=49.0), *parts.turned(points, normals, grown))
    assert before.max() > 1.0
    # The spot's disk is drawn in a frame of its own, which does not turn with the lamp: compare means of 64 samples.
    difference = (after - before).reshape(-1, 64, 3).mean(axis=1)
    assert np.abs(difference).mean() < 0.01 * before.mean()


def test_the_airlight_that_a_lamp_in_fog_is_held_to_is_the_published_integral():
    """Sun et al. 2005 in a form of its own: thin fog and a ray endless both ways give σ_s·I/(4h)."""
    from rtgi_addon.evaluate.stability import media
    found, distance = media.airlight(0.01, 200.0 * 0.01), 0.01
    thin = media.SCATTERING / (4.0 * np.pi * distance) * (np.pi / 2 + np.arctan(200.0))
    assert found == pytest.approx(thin * np.exp(-(media.SCATTERING + media.ABSORPTION) * 2.0), rel=0.01)


@pytest.mark.parametrize(("name", "step"), [("media-steps", "4 slices"), ("media-thin", "4 mm")])
def test_media_cases_notice_a_step_of_constant_light(monkeypatch, name, step):
    """A picture that took what is in a part of a slice for all of it would fail them."""
    from rtgi_addon.effects.media import froxels
    exact = froxels.Presence.of

    def by_slices(fillings, columns):
        found, widths = exact(fillings, columns), np.diff(columns.shape.limits)[:, None]
        return replace(found, length=[np.where(length > 0, widths, 0.0).astype(np.float32) for length in found.length])

    monkeypatch.setattr(froxels.Presence, "of", staticmethod(by_slices))
    result = stability.measure(CASES[name], "probes")
    assert result.verdict == WORSE and {sample.parameter: sample.value for sample in result.samples}[step] > 0.05

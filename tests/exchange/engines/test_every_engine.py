"""What every engine's export keeps, whatever it writes."""

from dataclasses import replace

import pytest

from rtgi_addon.errors import BakeError, UsageError
from rtgi_addon.exchange import engines
from rtgi_addon.exchange.engines import ExportSettings


@pytest.fixture
def bundle(kit_bundle, name):
    """The kit's probes as a bake would have written them, as many of its volumes as the engine ``name`` reads."""
    grids = tuple(grid for grid in kit_bundle.grids if engines.get(name).scattered or grid.volume.scattered is None)
    return replace(kit_bundle, manifest={"scene": "Kit", **kit_bundle.manifest}, grids=grids)


@pytest.mark.parametrize("name", engines.names())
def test_it_says_what_it_is(name):
    engine = engines.get(name)
    assert engine.name == name and engine.title and engine.description and not engine.description.endswith(".")
    assert all(engines.get(alias) is engine for alias in engine.aliases)


@pytest.mark.parametrize("conformance", [True, False])
@pytest.mark.parametrize("name", engines.names())
def test_a_bundle_is_exported_and_replaced_beside_what_is_not_ours(name, conformance, bundle, tmp_path):
    engine, out = engines.get(name), tmp_path / "out"
    report = engine.export(bundle, out, ExportSettings(conformance=conformance))
    assert report.out == out and report.engine == name and "README.md" in report.files
    assert report.volumes == tuple(grid.volume.name for grid in bundle.grids)
    assert all((out / file).stat().st_size for file in report.files)
    assert engine.export(bundle, out, ExportSettings(conformance=conformance)).files == report.files
    (out / "mine.txt").write_text("keep me")
    assert engine.export(bundle, out, ExportSettings(conformance=conformance)).kept == ()
    assert (out / "mine.txt").read_text() == "keep me"
    (tmp_path / "project").mkdir()
    (tmp_path / "project" / "mine.txt").write_text("keep me")
    with pytest.raises(BakeError, match=r"mine\.txt"):
        engine.export(bundle, tmp_path / "project")


@pytest.mark.parametrize("name", engines.names())
def test_what_goes_into_a_project_is_a_part_of_the_whole(name, bundle, tmp_path):
    engine = engines.get(name)
    whole = engine.export(bundle, tmp_path / "whole")
    if not engine.parts:
        with pytest.raises(UsageError, match="no part that goes into projects"):
            engine.export(bundle, tmp_path / "project", ExportSettings(part="files"))
        return
    part = engine.export(bundle, tmp_path / "project", ExportSettings(part="files"))
    assert part.files and set(part.files) == {file for file in whole.files if file.split("/")[0] in engine.parts}
    assert all((part.out / file).read_bytes() == (whole.out / file).read_bytes() for file in part.files)


@pytest.mark.parametrize("name", engines.names())
def test_without_its_kit_an_export_is_smaller(name, bundle, tmp_path):
    whole = engines.get(name).export(bundle, tmp_path / "whole")
    without = engines.get(name).export(bundle, tmp_path / "without", ExportSettings(conformance=False))
    assert set(without.files) <= set(whole.files)

"""The pre-flight alone: what would spoil a bake of a scene, and what in its file is not followed."""

from dataclasses import asdict, dataclass, replace

from ..errors import BakeError
from ..evaluate.concerns import Concern, concerns
from ..evaluate.receivers import open_probes
from ..exchange.plain import plain
from ..progress import Progress
from ..scene import Scene
from ..scene.checks import Finding, check_scene, require
from ..techniques.lattice.coverage import coverage_findings, placement_findings
from ..techniques.lattice.focus import probes_of
from ..transport.context import LightContext


@dataclass(frozen=True)
class CheckReport:
    """What was found in a scene: see ``check``."""

    scene: str
    findings: tuple[Finding, ...]
    not_followed: tuple[Concern, ...]
    notes: tuple[str, ...]

    @property
    def refusal(self) -> BakeError | None:
        """Why no bake would begin, or None."""
        try:
            require(self.findings)
        except BakeError as error:
            return error
        return None

    def to_json(self) -> dict:
        """The report as JSON-able values."""
        return plain({"scene": self.scene, "passes": self.refusal is None,
                      "findings": [_entry(finding) for finding in self.findings],
                      "not_followed": [concern.to_json() for concern in self.not_followed], "notes": self.notes})

    def to_text(self) -> str:
        """The report as lines for a person."""
        lines = [*(f"  {finding.severity:8} {finding}" for finding in self.findings),
                 *(f"  omitted  {concern}" for concern in self.not_followed), *(f"  note     {note}" for note in self.notes)]
        verdict = "can be baked" if self.refusal is None else "cannot be baked"
        return "\n".join([f"{self.scene} {verdict}" + ("" if lines else ": nothing to report"), *lines])


def _entry(finding: Finding) -> dict:
    objects, materials = finding.subject
    return {**asdict(finding), "objects": objects, "materials": materials}


def check(scene: Scene, *, threads: int | None = None, progress: Progress | None = None) -> CheckReport:
    """Look for trouble in ``scene`` before any bake, and estimate how much light each of its omissions concerns. An omission that
    refuses a bake is among the findings alone."""
    progress = progress or Progress()
    progress.step(0.0, "Checking the scene")
    findings = tuple(check_scene(scene))
    context = None
    if not any(finding.severity == "error" for finding in findings):
        progress.step(0.2, "Looking where probes lie")
        context = LightContext(scene, threads)
        findings += (*placement_findings(context, progress.span(0.2, 0.5)), *coverage_findings(scene, scene.volumes))
    omissions = tuple(omission for omission in scene.omissions if not omission.remedy)
    report = CheckReport(scene.name, findings, tuple(Concern(omission, None) for omission in omissions), scene.notes)
    if omissions and context is not None and report.refusal is None:
        progress.step(0.5, "Estimating what was left out")
        in_the_open = probes_of(scene.volumes)[open_probes(context, scene.volumes)]
        report = replace(report, not_followed=concerns(context, in_the_open, omissions))
    progress.step(1.0, "Done")
    return report

"""The suite's results as Markdown for people and JSON for programs."""

from dataclasses import dataclass

import numpy as np

from ...errors import BakeError
from ...words import as_lines
from .case import ABOVE, HOLDS, WEAK, WORSE, Result

SCHEMA = "rtgi-stability/1"


@dataclass(frozen=True, eq=False)
class StabilityReport:
    """``results`` of cases as they are, ``variants`` of the same with a remedy left out or added; ``pictures`` by (case, technique)
    name files relative to the report. ``seed`` is that of every bake."""

    results: tuple[Result, ...]
    variants: tuple[Result, ...] = ()
    pictures: dict[tuple[str, str], str] | None = None
    seed: int = 1
    out: str = ""
    cancelled: bool = False

    @property
    def worse(self) -> list[Result]:
        """The results that passed their bound."""
        return [result for result in self.results if result.verdict == WORSE]

    @property
    def refusal(self) -> BakeError | None:
        """Why a run of it has failed, or None: bounds that were passed."""
        if not self.worse:
            return None
        names = ", ".join(f"{result.case.name} of {result.technique} ({result.figure:.3g}, bound {result.limit.bound:g})"
                          for result in self.worse)
        return BakeError(f"worse than the stored bounds: {names}", f"see it alone with: {self.worse[0].command}")

    @property
    def _on_own_scene(self) -> bool:
        """Whether the cases are those of a user's own scene, which have no bounds."""
        return any(result.case.remedies is not None for result in self.results)

    def to_json(self) -> dict:
        """Everything measured, as JSON-able values."""
        return {"schema": SCHEMA, "seed": self.seed, "out": self.out, "complete": not self.cancelled,
                "cases": [self._json(result) for result in self.results],
                "variants": [{**self._json(result), "variant": result.variant.name, "remedy": result.variant.remedy}
                             for result in self.variants]}

    def _json(self, result: Result) -> dict:
        entry = {
            "case": result.case.name, "failure": result.case.failure, "scene": result.case.scene, "metric": result.case.metric,
            "sweep": result.case.sweep, "technique": result.technique, "figure": _plain(result.figure),
            "at": result.worst.parameter,
            "goal": result.case.goal, "seconds": round(result.seconds, 3), "command": result.command,
            "samples": [{"parameter": sample.parameter, "value": _plain(sample.value)} for sample in result.samples]}
        if result.variant is not None:
            return {**entry, "settings": result.variant.settings}
        return {**entry, "bound": _plain(result.limit.bound), "why": result.limit.why, "verdict": result.verdict,
                "picture": (self.pictures or {}).get((result.case.name, result.technique))}

    def to_text(self) -> str:
        """One line a result, for a shell."""
        lines = [f"{result.case.name:18} {result.technique:7} {_number(result.figure):>8}  {_held_to(result):14}  "
                 f"{result.verdict}, worst at {result.worst.parameter}" for result in self.results]
        lines += [f"{result.case.name:18} {result.technique:7} {_number(result.figure):>8}  {_kind(result)} {result.variant.name}"
                  for result in self.variants]
        verdicts = [result.verdict for result in self.results]
        known = (HOLDS, ABOVE) if self._on_own_scene else (HOLDS, WEAK, WORSE)
        counts = ", ".join(f"{verdicts.count(verdict)} {verdict}" for verdict in known)
        lines += [f"  {result.case.name} of {result.technique}: {result.limit.why}" for result in self.results
                  if result.verdict == ABOVE]
        return as_lines([*lines, counts + (f"; the report is in {self.out}" if self.out else "")])

    def to_markdown(self) -> str:
        """The whole report."""
        above = ("what makes it smaller stands below each table" if self._on_own_scene
                 else "*known weakness*: above it, within the technique's own bound; *worse*: above that")
        lines = ["# Stability", "", f"Every figure is 0 where nothing fails. *holds*: within the case's goal; {above}. Seed "
                 f"{self.seed}." + (" **Cancelled before its end.**" if self.cancelled else ""), ""]
        names = list(dict.fromkeys(result.technique for result in self.results))
        lines += ["| case | goal | " + " | ".join(names) + " |", "|---|---:|" + "---:|" * len(names)]
        for case in dict.fromkeys(result.case for result in self.results):
            row = {result.technique: result for result in self.results if result.case is case}
            cells = [f"{_number(row[name].figure)}{_MARKS[row[name].verdict]}" if name in row else "" for name in names]
            lines.append(f"| [{case.name}](#{case.name}) | {_number(case.goal)} | " + " | ".join(cells) + " |")
        lines += ["", "Unmarked: holds. `*`: above its goal." if self._on_own_scene
                  else "Unmarked: holds. `*`: known weakness. `!`: worse than its bound."]
        for case in dict.fromkeys(result.case for result in self.results):
            lines += self._section(case)
        return "\n".join(lines) + "\n"

    def _section(self, case) -> list[str]:
        results = [result for result in self.results if result.case is case]
        lines = ["", f"## {case.name}", "", f"{case.failure[0].upper()}{case.failure[1:]}. Scene: {case.scene}. Figure: "
                 f"{case.metric}; the largest over the sweep of: {case.sweep}. Goal: {_number(case.goal)}.", "",
                 "| technique | figure | bound | verdict | worst at | sweep |", "|---|---:|---:|---|---|---|"]
        for result in results:
            sweep = ", ".join(f"{sample.parameter}: {_number(sample.value)}" for sample in result.samples)
            bound = _number(result.limit.bound) if case.remedies is None else ""
            lines.append(f"| {result.technique} | {_number(result.figure)} | {bound} | {result.verdict} | "
                         f"{result.worst.parameter} | {sweep} |")
        lines += ["", *(f"- {result.technique}: {result.limit.why}." for result in results
                        if result.limit.why and (case.remedies is None or result.verdict == ABOVE))]
        variants = [result for result in self.variants if result.case is case]
        if variants:
            lines += ["", "| technique | | figure | as it is by default |", "|---|---|---:|---:|"]
            usual = {result.technique: result.figure for result in results}
            lines += [f"| {result.technique} | {_kind(result)} {result.variant.name} | {_number(result.figure)} | "
                      f"{_number(usual[result.technique])} |" for result in variants]
        for result in results:
            picture = (self.pictures or {}).get((case.name, result.technique))
            if picture:
                lines += ["", f"![{result.technique}, {case.name}: worst left, best right]({picture})"]
        return [*lines, "", *(f"    {result.command}" for result in results)]


_MARKS = {HOLDS: "", WEAK: " *", WORSE: " !", ABOVE: " *"}


def _held_to(result: Result) -> str:
    kind, value = ("bound", result.limit.bound) if result.case.remedies is None else ("goal", result.case.goal)
    return f"{kind} {_number(value):>8}"


def _kind(result: Result) -> str:
    return "with" if result.variant.remedy else "instead:"


def _number(value: float) -> str:
    if not np.isfinite(value):
        return "none" if np.isnan(value) else "infinite"
    return f"{value:.2g}" if abs(value) < 10 else f"{value:.0f}"


def _plain(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None

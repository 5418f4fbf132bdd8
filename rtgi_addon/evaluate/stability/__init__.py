"""The stability suite: scenes in which methods of global illumination are known to fail, and how much ours do. A failure comes in
as a `Case` in one of the families, with a bound for every technique in `limits`; CONTRIBUTING.md says how.

`case` says what a case is, the families (`leaks`, `geometry`, `energy`, `motion`) hold them with their scenes made of `parts`,
`limits` what each technique is held to, `own` makes cases of a user's own scene, `suite` runs them, `report` and `picture` show
what was found.
"""

from .case import ABOVE, HOLDS, WEAK, WORSE, Bench, Case, Result, Sample, Variant
from .limits import Limit
from .own import own_cases
from .picture import draw_result
from .report import StabilityReport
from .suite import CASES, chosen, measure

__all__ = ["ABOVE", "CASES", "HOLDS", "WEAK", "WORSE", "Bench", "Case", "Limit", "Result", "Sample", "StabilityReport", "Variant",
           "chosen", "draw_result", "measure", "own_cases"]

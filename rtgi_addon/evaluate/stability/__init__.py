"""The stability suite: scenes in which methods of global illumination are known to fail, and how much ours do.

`case` says what a case is, the families (`leaks`, `geometry`, `energy`, `motion`) hold them with their scenes made of `parts`,
`limits` what each technique is held to, `suite` runs them, `report` and `picture` show what was found.
"""

from .case import HOLDS, WEAK, WORSE, Bench, Case, Result, Sample, Variant
from .limits import Limit
from .picture import draw_result
from .report import StabilityReport
from .suite import CASES, chosen, measure

__all__ = ["CASES", "HOLDS", "WEAK", "WORSE", "Bench", "Case", "Limit", "Result", "Sample", "StabilityReport", "Variant", "chosen",
           "draw_result", "measure"]

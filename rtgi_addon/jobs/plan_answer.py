"""A plan's answer, before its reasons: what is baked, how right that is, what it costs. Three lines, for shell and panel."""

from ..evaluate.plan import Plan
from ..evaluate.plan.reasons import percent, size
from ..evaluate.plan.tries import CONFIDENCE, upper
from ..techniques.lattice.resample import VISIBILITY_RESOLUTION
from .console import duration

_MIB = 1 << 20
# Numbers of a probe beside its coefficients and distances: validity, offset, error.
_OTHERS = 5
# Below so many seconds a person wants a digit behind the point.
_SHORT = 10.0


def answer(plan: Plan) -> tuple[str, str, str]:
    """What is planned, its error, its costs: a line each."""
    return what(plan), error(plan), cost(plan)


def what(plan: Plan) -> str:
    """Technique, settings and lattices."""
    settings = ", ".join(name if value is True else f"{name} {value:g}" for name, value in plan.settings.items())
    lattices = ", ".join(f"{volume.name} {size([volume.resolution])}" for volume in plan.volumes)
    return f"{plan.technique} with {settings} on {lattices}: {plan.probes:,} probes"


def error(plan: Plan) -> str:
    """How far off light on surfaces will be, held to what was asked."""
    found, asked = plan.chosen.error, percent(plan.target.error)
    verdict = f"within the {asked} asked for" if plan.met else f"the best there is, {asked} is out of reach"
    return (f"light on surfaces off by {percent(found.value)}, below {percent(upper(found))} with {100 * CONFIDENCE:.0f} % "
            f"confidence: {verdict}")


def cost(plan: Plan) -> str:
    """Time on this machine, memory, and what the bundle takes before it is compressed."""
    price, order = plan.chosen.price, int(plan.settings.get("order", 2))
    disk = 4 * plan.probes * (3 * (order + 1) ** 2 + 2 * VISIBILITY_RESOLUTION**2 + _OTHERS)
    made, memory, most = plan.found.finished, f"{price.bytes / _MIB:,.0f}", f"{max(disk / _MIB, 0.1):,.1f}"
    if made is not None:
        # That of the bake which was made to plan it.
        return (f"{spoken(price.seconds)} on this machine and {spoken(made.fit_seconds)} for the fit, {memory} MiB of memory, "
                f"at most {most} MiB on disk")
    return f"{spoken(price.seconds)} on this machine, {memory} MiB of memory, at most {most} MiB on disk"


def by_rays(plan: Plan) -> str:
    """What the camera's picture takes by true rays, beside the planned bake; "" where that was not looked at."""
    look = plan.picture
    if look is None:
        return ""
    asked, (width, height) = plan.target.error, look.size
    own, bake = look.seconds(asked), plan.chosen.price.seconds
    start = (f"By true rays (the effect ray_traced) the picture through {look.camera!r}, {width} x {height}, is within "
             f"{percent(asked)} after about {look.samples(asked)} samples, in some {spoken(own)} and without a bake: ")
    if own <= bake:
        return start + "faster than the bake, and exact but for noise."
    if not plan.met:
        return start + f"slower than the bake, but exact where that stays off by {percent(plan.chosen.error.value)}."
    return start + f"slower than the bake of {spoken(bake)}, which serves every picture."


def spoken(seconds: float) -> str:
    """Seconds as a person says them: 0.4 s, 12 s, 3 min 20 s."""
    return f"{seconds:.1f} s" if seconds < _SHORT else duration(seconds)

"""Route: where a robot enters a lumen and where it is going, the pathway between both, and how far the robot comes."""

from app.tabs.route.commands import COMMANDS
from app.tabs.route.sections import RouteSections
from app.tabs.spec import TabSpec

SPEC = TabSpec(
    "route",
    "Route",
    21,
    __name__,
    "RouteTab",
    COMMANDS,
    RouteSections,
    documents=("route",),
    kinds=("lumen",),
    needs="case",
)

"""A tab of the page on the server: a class with defaults that do nothing.

A client's session makes one object of each tab and calls it on the session's own thread, one request after another.
Methods that say so are called on other threads, at once, and must be quick and thread-safe.
"""

from __future__ import annotations

from typing import Any, ClassVar, Protocol

from app.kit.kept import Same
from app.messages.fields import ClientMessage
from app.messages.sections import Sections
from app.operations.messages import OperationMessage
from app.scene.dragging import DragEvent
from app.scene.hand import GripDrag
from app.scene.view import ClickRay
from app.services import Services
from app.tabs.spec import TabSpec
from app.workspace.layers import Layer
from app.workspace.workspace import Position, Workspace


class Closable(Protocol):
    """What the clients of a tab share."""

    def close(self) -> None: ...


class Tab:
    """Base class of the tabs.

    spec: what is declared of the tab. ticks: its sections and layers are published with every tick, at 50 Hz while it
    is :attr:`lively`, and not after requests alone. first_view: where the camera looks from when the scene comes while
    the tab is active.
    """

    spec: ClassVar[TabSpec]
    ticks: ClassVar[bool] = False
    first_view: ClassVar[str] = "oblique"

    @classmethod
    def make_shared(cls, services: Services) -> Closable | None:
        """What all clients of this tab share; made once per planner, closed with it, handed to each object."""
        return None

    def __init__(self, workspace: Workspace, shared: Any = None) -> None:
        self.workspace, self.shared = workspace, shared
        self.active = False  # the client is in this tab

    # -- entering and leaving

    @property
    def offered(self) -> bool:
        """Whether the tab is for cases of the kind that is open; all are where none is."""
        kind = self.workspace.case.kind
        return not self.spec.kinds or kind is None or kind in self.spec.kinds

    @property
    def available(self) -> bool:
        """Whether the tab can be opened: it is offered, and what it needs is there."""
        needs, workspace = self.spec.needs, self.workspace
        missing = (needs == "case" and workspace.case.case_id is None) or (
            needs == "plan" and workspace.plan.id is None
        )
        return self.offered and not missing

    def enter(self) -> None:
        """The client comes to this tab."""

    def leave(self) -> None:
        """The client goes to another tab."""

    def close(self) -> None:
        """The session ends."""

    # -- requests

    def handle(self, command: ClientMessage) -> Any:
        """Answer one of the tab's commands; returns what the reply holds. Raises VfixError with the reason."""
        return None

    def operate(self, message: OperationMessage) -> Any:
        """Do an operation on a document of the kinds that the spec names. Raises VfixError with the reason."""
        return self.workspace.operate(message)

    def handle_now(self, command: ClientMessage) -> None:
        """Answer one of the tab's urgent commands. Called on other threads."""

    def clicked(self, ray: ClickRay) -> None:
        """A click in the scene while the tab is active: the view turns about what it meets."""
        hit = self.workspace.case.hit(ray)
        if hit is not None:
            self.workspace.camera.turn_about(hit.position)

    def dragged(self, drag: DragEvent) -> None:
        """A point or target of the scene is dragged while the tab is active."""

    def gripped(self, drag: GripDrag) -> None:
        """The grip of the robot is dragged while the tab is active. Called on other threads."""

    # -- time and presence

    @property
    def lively(self) -> bool:
        """Whether what the tab shows changes by itself."""
        return False

    def tick(self) -> bool:
        """The planner's clock: 50 Hz while a tab is lively, else once a second; True publishes everything.

        What changes by itself is read here: :meth:`refresh` is not called after a tick alone.
        """
        return False

    def release_now(self) -> None:
        """The page or its scene is gone: a hand lets go at once. Called on other threads."""

    def release(self) -> None:
        """The same on the session's thread, for what needs no hurry."""

    def give_up(self) -> None:
        """The page has been gone for some seconds: what only one client can have is free."""

    def abandon(self) -> None:
        """The page has been gone for minutes: what nobody else uses is ended."""

    def come_back(self) -> None:
        """The page is there again."""

    # -- what the page and the scene show

    def subject(self) -> object:
        """What the tab shows besides what its requests and ticks change, as a key.

        After a request that was about another tab, this one is not asked anything while its subject is equal.
        """
        shown, changes = self.workspace.case, self.workspace.services.store.changes
        return Same(shown.case), shown.loading, Same(self.workspace.plan.current), changes.count

    def refresh(self) -> None:
        """Bring what is shown up to date with the store, which others change too; before sections and layers are asked.

        Called often: whoever reads the store asks its `changes` first.
        """

    def sections(self) -> Sections:
        """The tab's sections by name, each with a key of whatever it depends on, which building it does not change.

        Every tab's are published; of two with one name those of the active tab count.
        """
        return {}

    def layers(self) -> list[Layer[Any]]:
        """What the tab adds to the scene; of two layers with one name that of the active tab is drawn."""
        return []

    def places(self) -> list[Position]:
        """Places [LPS mm] that a near view of the anatomy has to show."""
        return []

    @property
    def busy(self) -> bool:
        """Whether the tab's own hint goes before all others, such as while a robot moves."""
        return False

    def hint(self) -> str:
        """What to do next, in one sentence, while the tab is active."""
        return ""

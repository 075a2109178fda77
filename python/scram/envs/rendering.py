"""How an environment is shown: as pixels, or as the page that ``scram sim --view`` makes."""

import tempfile
import webbrowser
from pathlib import Path

import gymnasium
import numpy as np
from numpy.typing import NDArray

from scram._scram import Environments

RENDER_MODES = ["rgb_array", "human"]
"""What ``render_mode`` may be."""
SIZE = (640, 480)
"""Width and height of a picture, pixels, where nothing else is said."""


class Renderer:
    """Shows one of some environments.

    ``rgb_array`` draws the robot as it is. ``human`` keeps the episode and writes it as one page of HTML at ``render``, at the
    episode's end, and where it is broken off by a reset or ``close``; a browser is opened on the first one. The page is
    ``page_path``, by default in a temporary directory, which stays and of which a person is told.
    """

    def __init__(
        self, environments: Environments, index: int, mode: str | None, size: tuple[int, int], page_path: str | Path | None
    ) -> None:
        if mode is not None and mode not in RENDER_MODES:
            raise ValueError(f"render_mode: there is no {mode!r}; give one of {', '.join(RENDER_MODES)}, or None")
        self._environments = environments
        self._index = index
        self.mode = mode
        self._size = size
        self._opened = False
        self._over = False
        self._is_ours = page_path is None
        self._page_path = None if page_path is None else Path(page_path)
        if mode == "human":
            environments.record(index)

    @property
    def page_path(self) -> Path | None:
        """Where the page is written; None where there is none."""
        if self._page_path is None and self.mode == "human":
            self._page_path = Path(tempfile.mkdtemp(prefix="scram-")) / "episode.html"
        return self._page_path if self.mode == "human" else None

    def render(self) -> NDArray[np.uint8] | None:
        """A picture, height × width × 3, or the page written anew."""
        if self.mode == "rgb_array":
            return self._environments.picture(self._index, *self._size)
        self.write_page()
        return None

    def end(self) -> None:
        """Writes the page of an episode that is over, before anything is added to it."""
        self.write_page()
        self._over = True

    def leave(self) -> None:
        """Writes the page of an episode that goes no further, if it was not over."""
        if not self._over:
            self.write_page()
        self._over = False

    def write_page(self) -> None:
        """Writes the page of the present episode, if it is kept and has begun."""
        file = self.page_path
        if file is None:
            return
        page = self._environments.page(self._index, "Episode")
        if page is None:
            return
        file.write_text(page, encoding="utf-8")
        if not self._opened:
            self._opened = True
            if self._is_ours:
                gymnasium.logger.warn(f"episodes are shown by {file}, which stays there: page_path=FILE names another place")
            webbrowser.open(file.resolve().as_uri())

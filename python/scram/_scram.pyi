from os import PathLike
from typing import final

@final
class Robot:
    def __new__(cls, path: str | PathLike[str]) -> Robot: ...
    @property
    def name(self) -> str: ...

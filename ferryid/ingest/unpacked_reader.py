"""A log compressed as a whole by zstd or lz4 (``trial.mcap.zst``, ``trial.bag.lz4``), outside a ROS2 folder."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from ferryid.errors import FerryIdError
from ferryid.files import remove_scratch
from ferryid.ingest.log import Loss, Reader, Series, TableLayout, Topic
from ferryid.ingest.parameters import Parameter, parameters_of
from ferryid.ingest.unpack import codec_of, unpack_file, working_folder


class UnpackedLog:
    """The log inside a compressed file: unpacked into a temporary folder that goes with this object."""

    def __init__(self, path: Path, layout: TableLayout | None) -> None:
        # The formats of what is inside are found by the package that found this one.
        from ferryid.ingest import open_log

        self.paths = (path,)
        folder = working_folder(self)
        try:
            self._inner_path, self._lost = unpack_file(path, folder)
            with self._inner_path.open("rb") as file:
                if codec_of(file.read(64)):
                    raise FerryIdError(
                        f"{path}: a compressed file in a compressed file, found nothing to read. Fix: unpack it by hand"
                    )
            try:
                self._inner: Reader = open_log(self._inner_path, layout)
            except FerryIdError as error:
                raise FerryIdError(self._told(str(error))) from error
        except BaseException:
            # An exception keeps this object, and with it the folder, for as long as it is kept itself.
            remove_scratch(folder)
            raise
        self.topics: tuple[Topic, ...] = self._inner.topics

    @property
    def losses(self) -> tuple[Loss, ...]:
        """What unpacking lost, then what the log inside lacks."""
        inner = (replace(one, file=str(self.paths[0]), what=self._told(one.what)) for one in self._inner.losses)
        return (*self._lost, *inner)

    @property
    def parameters(self) -> Mapping[str, Parameter]:
        """Parameters of the log inside."""
        return parameters_of(self._inner)

    def read(self, wanted: Mapping[str, Sequence[str]], *, verify: bool = False) -> dict[str, Series]:
        """Decode the wanted fields of the log inside.

        Raises
        ------
        FerryIdError
            For a topic or field that the log does not have.
        """
        try:
            return self._inner.read(wanted, verify=verify)
        except FerryIdError as error:
            raise FerryIdError(self._told(str(error))) from error

    def _told(self, text: str) -> str:
        """Name the file that the user knows instead of the temporary one."""
        return text.replace(str(self._inner_path), str(self.paths[0]))

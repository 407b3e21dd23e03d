"""Studies: samples drawn and counted, machines that are balanced or starts of a calibration."""

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rotorid.study.studies import StudyOptions as StudyOptions
    from rotorid.study.studies import study as study
    from rotorid.study.study_result import StudiedMachines as StudiedMachines
    from rotorid.study.study_result import StudiedStarts as StudiedStarts

_HOME = {
    **dict.fromkeys(("StudyOptions", "study"), "studies"),
    **dict.fromkeys(("StudiedMachines", "StudiedStarts"), "study_result"),
}

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)

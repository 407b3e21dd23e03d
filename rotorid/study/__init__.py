"""Studies: drawn machines that are read, balanced and counted."""

from rotorid.base.lazy_names import lazy_names

TYPE_CHECKING = False
if TYPE_CHECKING:
    from rotorid.study.studies import StudyOptions as StudyOptions
    from rotorid.study.studies import study as study

_HOME = dict.fromkeys(("StudyOptions", "study"), "studies")

__all__ = [*_HOME]

__getattr__, __dir__ = lazy_names(__name__, _HOME)

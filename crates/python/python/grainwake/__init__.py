"""Real grains settling in a viscous fluid, resolved around each grain.

`Grain` is a shape, `Case` describes a simulation, `Case.run` fills a run folder, `open` reads it,
and `Simulation` steps a case in memory. Numbers are SI; strings carry their unit ("2 mm").
"""

from ._errors import CaseError, CaseWarning, Problem, SolverError
from ._grainwake import Case, Grain, Scan, Simulation, Study, __version__, commit, scan
from ._results import RunFolder
from ._simulation import State, frame
from ._studies import StudyFolder, open, open_run, open_study, validate

__all__ = [
    "Case",
    "CaseError",
    "CaseWarning",
    "Grain",
    "Problem",
    "RunFolder",
    "Scan",
    "Simulation",
    "SolverError",
    "State",
    "Study",
    "StudyFolder",
    "__version__",
    "commit",
    "frame",
    "open",
    "open_run",
    "open_study",
    "scan",
    "validate",
]

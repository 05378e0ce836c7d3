"""Work folders of tests and scripts that run one after the other in the same place."""
import pathlib
import shutil
import tempfile


def fresh(place):
    """A new empty folder in `place`, whose other contents are removed as far as that goes: programs
    of a run that was killed may still be writing there, and never meet this one's files."""
    place = pathlib.Path(place).resolve()
    shutil.rmtree(place, ignore_errors=True)
    place.mkdir(parents=True, exist_ok=True)
    return pathlib.Path(tempfile.mkdtemp(dir=place))

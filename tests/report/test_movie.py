"""A film of a run: its frames, its pace, and where it may be written."""

from pathlib import Path

import numpy as np
import pytest

from bench.quick import quick
from palpate.bench import build
from palpate.errors import InputError
from palpate.files.writing import ours
from palpate.records import Record
from palpate.report.run import movie


@pytest.fixture(scope="module")
def record():
    return build(quick("foam-hybrid")).run(1.5, press=0.3)


@pytest.mark.long
def test_a_film_has_a_frame_for_each_twentieth_of_a_second(record, tmp_path):
    from PIL import Image

    path = movie.write_movie(record, tmp_path / "arm.gif")
    rows, pace = movie.frames_of(record)
    assert ours(path)
    assert pace == 1.0
    with Image.open(path) as film:
        assert film.n_frames == len(rows)
        assert film.info["duration"] == 1000 // movie.FRAMES_PER_S
        first = np.asarray(film.convert("L"), dtype=float)
        film.seek(film.n_frames - 1)
        assert np.abs(np.asarray(film.convert("L"), dtype=float) - first).max() > 100, "something moves"
    movie.write_movie(record, path)  # palpate's own is replaced


def test_a_long_run_is_shown_faster():
    t = np.arange(0.0, 120.0, 0.01)
    long = Record({"t": t, "phase": np.where(t > 5.0, 1.0, 0.0)}, {"t": "s", "phase": "1"})
    rows, pace = movie.frames_of(long)
    assert len(rows) == movie.MOST
    assert pace == pytest.approx(116.0 * movie.FRAMES_PER_S / movie.MOST, rel=0.01)
    assert t[rows[0]] == pytest.approx(4.0, abs=0.02)


def test_what_is_no_film_is_refused(record, tmp_path):
    with pytest.raises(InputError, match=r"a film is a GIF; name it .*arm\.gif"):
        movie.write_movie(record, tmp_path / "arm.mp4")
    (tmp_path / "mine.gif").write_bytes(b"GIF89a of somebody else")
    with pytest.raises(InputError, match="palpate did not write it"):
        movie.write_movie(record, tmp_path / "mine.gif")
    none = Record({n: c[:1] for n, c in record.columns.items()}, record.units, record.meta)
    with pytest.raises(InputError, match="no film"):
        movie.write_movie(none, Path(tmp_path / "none.gif"))

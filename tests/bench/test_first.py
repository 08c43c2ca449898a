import subprocess
import sys
from pathlib import Path


def test_first_and_later_runs_are_told_apart():
    script = Path(__file__).with_name("first.py")
    told = subprocess.run(
        [sys.executable, str(script), "--rounds", "1"], check=True, capture_output=True, text=True
    ).stdout.splitlines()[1:]
    assert len(told) == 6
    for line in told:
        first, _, later, _ = map(float, line.split()[3:])
        assert 0 < later < 10 * first, line

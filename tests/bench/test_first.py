import first


def test_first_and_later_runs_are_told_apart(capsys):
    first.main(["--rounds", "1"])
    told = capsys.readouterr().out.splitlines()[1:]
    assert len(told) == 6
    for line in told:
        once, _, later, _ = map(float, line.split()[3:])
        assert 0 < later < 10 * once, line

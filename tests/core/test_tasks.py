"""How long many tasks take is said before they begin."""

from clearance_mj.core.tasks import print_duration


def test_the_time_of_many_tasks_is_that_of_the_second_one(monkeypatch, capsys):
    """The first one compiles, and is not counted: 200 tasks of half a second are 50 s of each of two workers."""
    clock, done = iter((10.0, 10.5)), []
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))
    print_duration("designs", lambda: done.append(1), 200, 2)
    assert len(done) == 2
    assert capsys.readouterr().err == (
        "designs: about 50 s on 2 processes (up to 2 min where they share cores with each other or with other work), "
        "by one timed here\n"
    )

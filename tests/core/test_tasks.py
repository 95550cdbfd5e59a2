"""How long many tasks take is said before they begin."""

from clearance_mj.core.tasks import print_duration


def test_the_time_of_many_tasks_is_that_of_the_second_one(monkeypatch, capsys):
    """The first call compiles, and is not counted: 200 tasks of half a second are 50 s of each of two workers."""
    clock, done = iter((10.0, 10.2, 10.7, 16.0, 16.0)), []
    monkeypatch.setattr("time.perf_counter", lambda: next(clock))
    print_duration("designs", [lambda: done.append(1), lambda: done.append(2), lambda: done.append(3)], 200 / 6, 2)
    assert done == [1, 1, 2]  # the third one is beyond the seconds that are timed
    assert capsys.readouterr().err == (
        "designs: about 50 s on 2 processes (up to 2 min where they share cores with each other or with other work), "
        "by 2 timed here\n"
    )

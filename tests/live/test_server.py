"""The live page's server: who it refuses, what it never reads, and that bad messages do nothing."""

import asyncio
import http.client
import json
import threading

import numpy as np
import pytest

pytest.importorskip("tornado", reason="the live page needs Tornado (the extra live)")

from tornado.httpclient import HTTPClientError, HTTPRequest
from tornado.websocket import websocket_connect

from clearance_mj import ClearanceError, ConstantLaw, Model, Plate
from clearance_mj.live.figures import Numbers
from clearance_mj.live.hear import heard
from clearance_mj.live.server import Page
from clearance_mj.live.session import Session
from clearance_mj.live.wire import MAX_BYTES, packed, parsed
from clearance_mj.sound import Sound, radiate, resampled

from ..conftest import TABLE1
from ..processes import PATIENCE

LAW = ConstantLaw(7.8e3, 4.0)
SET = {"type": "set", "id": 1, "values": {"duration": 4.0}}


@pytest.fixture(scope="module")
def page():
    made = Page(Model(TABLE1.replace(name="<script>alert(1)</script>"), LAW))
    loop, ready = asyncio.new_event_loop(), threading.Event()
    task = loop.create_task(made.run(ready.set))
    thread = threading.Thread(target=lambda: loop.run_until_complete(asyncio.wait([task])))
    thread.start()
    assert ready.wait(PATIENCE)
    yield made
    loop.call_soon_threadsafe(task.cancel)
    thread.join(PATIENCE)
    loop.close()


def unpacked(data):
    size = int.from_bytes(data[:4], "little")
    head, at = json.loads(data[4 : 4 + size]), 4 + size
    for name, shape in head["arrays"]:
        count = int(np.prod(shape))
        head[name] = np.frombuffer(data, "<f4", count, at).reshape(shape)
        at += 4 * count
    return head


def fetched(page, path, method="GET", body=None, **headers):
    connection = http.client.HTTPConnection("127.0.0.1", page.port, timeout=10)
    try:
        connection.request(method, path, body, {k.replace("_", "-"): v for k, v in headers.items()})
        answer = connection.getresponse()
        return answer.status, answer.read(), answer.headers
    except (ConnectionError, http.client.RemoteDisconnected):
        return 0, b"", {}
    finally:
        connection.close()


def limited(coroutine):
    return asyncio.run(asyncio.wait_for(coroutine, PATIENCE))


async def connected(page, origin=None, token=None, **headers):
    url = f"ws://127.0.0.1:{page.port}/{token or page.token}/socket"
    origins = {"Origin": origin or f"http://127.0.0.1:{page.port}"} if origin != "" else {}
    return await websocket_connect(HTTPRequest(url, headers=origins | headers))


def talk(page, *messages, until=1, origin=None, token=None, **headers):
    """Send messages after the greeting, and return the greeting and ``until`` answers."""

    async def run():
        socket = await connected(page, origin, token, **headers)
        heads = [unpacked(await socket.read_message())]
        for message in messages:
            await socket.write_message(message if isinstance(message, str | bytes) else json.dumps(message))
        while len(heads) <= until:
            data = await socket.read_message()
            if data is None:
                heads.append(None)
                break
            if (head := unpacked(data))["type"] != "progress":
                heads.append(head)
        socket.close()
        return heads

    return limited(run())


def test_the_page_and_nothing_else(page):
    status, body, headers = fetched(page, f"/{page.token}/")
    assert status == 200 and b"<title>clearance-mj live</title>" in body
    assert "default-src 'none'" in headers["Content-Security-Policy"] and headers["Referrer-Policy"] == "no-referrer"
    assert fetched(page, f"/{page.token}/uPlot.iife.min.js")[0] == 200
    for path in ("server.py", "../server.py", "..%2f..%2ferrors.py", "/etc/passwd", "%2fetc%2fpasswd", "page/live.js",
                 "....//live.css", "live.js%00", "rig.toml"):  # fmt: skip
        assert fetched(page, f"/{page.token}/{path}")[0] in (403, 404)
    for name in page.files:  # nothing that loads from elsewhere
        text = fetched(page, f"/{page.token}/{name}")[1].decode()
        assert 'src="http' not in text and 'href="http' not in text and "url(http" not in text and "//cdn" not in text


def test_only_this_machine_is_listened_to(page):
    assert [s.getsockname()[0] for s in page.sockets] == ["127.0.0.1"]
    assert len(page.token) >= 43 and Page(Model(TABLE1, LAW)).token != page.token
    with pytest.raises(ClearanceError, match=f"--port {page.port}: cannot be listened on"):
        Page(Model(TABLE1, LAW), port=page.port)


def test_who_is_refused(page):
    prefix = f"/{page.token}/"
    for path in ("/", "//", "/x/", "/live.js", f"/{page.token[:-1]}/", f"/{page.token}", "/%C3%A9/"):
        assert fetched(page, path)[0] == 403
    origins = [{"Origin": origin} for origin in ("http://evil.example", "null")]
    hosts = [{"Host": host} for host in ("evil.example", f"evil.example:{page.port}")]
    for headers in (*hosts, *origins, {"Sec_Fetch_Site": "cross-site"}):
        assert fetched(page, prefix, **headers)[0] == 403
    assert fetched(page, prefix, Host=f"localhost:{page.port}", Origin=f"http://localhost:{page.port}")[0] == 200
    assert fetched(page, prefix, "POST")[0] == 405
    assert fetched(page, prefix, "POST", b"x" * 100_000)[0] in (0, 400, 413)
    assert fetched(page, prefix, X="x" * 100_000)[0] in (0, 400, 431)


@pytest.mark.parametrize(
    "who", [{"token": "wrong"}, {"origin": ""}, {"origin": "http://evil.example"}, {"origin": "null"},
            {"origin": "http://127.0.0.1:1"}, {"Host": "evil.example"}]
)  # fmt: skip
def test_whose_websocket_is_refused(page, who):
    with pytest.raises(HTTPClientError) as refused:
        talk(page, SET, **who)
    assert refused.value.code == 403


def test_large_messages_close_their_connection_only(page):
    assert talk(page, json.dumps(SET | {"record": "x" * MAX_BYTES}))[-1] is None
    assert talk(page, SET)[-1]["type"] == "figures"


def test_figures_come_as_packed_numbers(page):
    hello, figures = talk(page, SET)
    assert hello["rig"] == "<script>alert(1)</script>" and len(hello["sensors"]) == 8
    session = page.session()
    expected = session.show(session.setting(SET["values"])).arrays["magnitude"]
    np.testing.assert_array_equal(figures["magnitude"], expected.astype("<f4"))
    assert figures["id"] == 1


def one_by_one(page, *messages):
    """Send each message once the one before has its answer, and return the answers."""

    async def run():
        socket = await connected(page)
        await socket.read_message()
        heads = []
        for message in messages:
            await socket.write_message(json.dumps(message))
            while (head := unpacked(await socket.read_message()))["type"] == "progress":
                pass
            heads.append(head)
        socket.close()
        return heads

    return limited(run())


def test_what_is_shown_can_be_heard(page):
    """The acceleration of a sensor, or the sound of the plate of a rig that has one, at 16000 samples per second."""
    hear = {"type": "hear", "slot": "A", "sensor": 7}
    early, _, answer, none = one_by_one(page, hear, SET, hear, hear | {"sensor": 8})
    assert (early["text"], none["text"]) == ("nothing is shown yet", "there is no sensor 9 to hear")
    session = page.session()
    shown = session.simulated(session.setting(SET["values"]))
    recorded = shown.response.acceleration[7]
    sound = Sound(recorded - recorded.mean(), shown.response.fs).faded(0.02)
    expected = resampled(sound.pressure, shown.response.fs, 16000.0)
    np.testing.assert_allclose(answer["samples"], expected, rtol=1e-5, atol=1e-5)
    facts = {"slot": "A", "unit": "m/s²", "rate": 16000.0, "of": "the acceleration 8:+Z", "values": shown.values}
    assert {key: answer[key] for key in facts} == facts
    rig = TABLE1.replace(plate=Plate(sensor=8, area=0.1, distance=1.0))
    of_plate = Session(Model(rig, LAW))
    shown = of_plate.simulated(of_plate.setting({"duration": 8.0}))
    sound, whole = heard(shown, 0), radiate(shown.response, rig)
    assert sound.facts["unit"] == "Pa" and sound.arrays["samples"].size == 6 * 16000
    assert sound.arrays["samples"].std() == pytest.approx(whole.between(2.0).faded(0.02).pressure.std(), rel=1e-3)


MALFORMED = [
    "", "{", "[]", "null", "7", '"set"', "[" * 50_000, b"\xff\xfe", '{"type": "set"}',
    '{"type": "open", "path": "/etc/passwd"}',
    '{"type": "set", "id": 1, "values": {"level": NaN}}', '{"type": "set", "id": -1, "values": {}}',
    '{"type": "set", "id": 1, "values": {"level": [1]}}', '{"type": "set", "id": 1, "values": {}, "more": 1}',
    '{"type": "set", "id": 1.5, "values": {}}', '{"type": "set", "id": 1, "values": {"level": true}}',
    '{"type": "sweep", "values": {}, "name": "level", "low": 1, "high": 2, "count": "3"}',
    '{"type": "set", "id": 1, "values": {"level": 1e999}}', '{"type": "export", "record": 1}',
    '{"type": "hear", "slot": "C", "sensor": 0}', '{"type": "hear", "slot": "A", "sensor": -1}',
    '{"type": "steps", "values": {}, "low": 1, "high": 2, "count": 3}',
]  # fmt: skip


def test_malformed_messages_do_nothing(page):
    assert [parsed(text) for text in MALFORMED] == [None] * len(MALFORMED)
    _, answer = talk(page, *(text for text in MALFORMED if isinstance(text, str)), SET)
    assert answer["type"] == "figures"


def test_what_cannot_be_shown_is_said_and_the_page_goes_on(page):
    first = talk(page, SET | {"values": {"duration": 4.0, "level": 1e200}})[-1]
    assert first["type"] == "problem" and "diverged" in first["text"] and first["id"] == 1
    assert talk(page, SET | {"record": "ramp"})[-1]["text"] == "the opened dataset has no record 'ramp'"
    assert talk(page, {"type": "export"})[-1]["text"] == "nothing is shown yet"
    steps = {"type": "steps", "values": {}, "low": 2, "high": 1, "count": 3, "hold": 1}
    assert "rising frequencies" in talk(page, steps)[-1]["text"]
    huge = SET | {"values": {"level": 10**400}}
    assert talk(page, json.dumps(huge), SET | {"id": 5}, until=1)[-1]["type"] in ("figures", "problem")
    assert talk(page, SET | {"id": 2})[-1]["type"] == "figures"


def test_the_newest_setting_wins(page):
    many = [SET | {"id": i, "values": {"duration": 4.0, "level": 1.0 + 0.01 * i}} for i in range(1, 40)]

    async def run():
        socket = await connected(page, origin=f"http://localhost:{page.port}")
        for message in many:
            await socket.write_message(json.dumps(message))
        seen = []
        while not seen or seen[-1] != 39:
            head = unpacked(await socket.read_message())
            seen += [head["id"]] if head["type"] == "figures" else []
        return seen

    seen = limited(run())
    assert seen == sorted(seen) and len(seen) < 10


def test_a_branch_is_cancelled(page):
    follow = {"type": "branch", "values": {"level": 4.0}, "low": 5, "high": 220}
    assert talk(page, follow, {"type": "cancel"})[-1] == {"type": "ended", "arrays": []}
    again = talk(page, follow, {"type": "cancel"}, follow | {"low": 42, "high": 43.5}, until=2)
    assert [answer["type"] for answer in again[1:]] == ["ended", "branch"]
    steps = {"type": "steps", "values": {}, "low": 20, "high": 30, "count": 3, "hold": 1.0}
    assert talk(page, steps)[-1]["up"].shape == (8, 3)
    sweep = {"type": "sweep", "values": {"duration": 4}, "name": "level", "low": 1, "high": 2, "count": 2}
    answer = talk(page, sweep)[-1]
    assert answer["type"] == "sweep" and answer["rms"].shape == (8, 2)


def test_packed_numbers():
    data = packed("x", Numbers({"a": float("nan"), "b": "ü"}, {"n": np.arange(6.0).reshape(2, 3)}), id=7)
    head = unpacked(data)
    assert (int.from_bytes(data[:4], "little") % 4, head["a"], head["b"], head["id"]) == (0, None, "ü", 7)
    np.testing.assert_array_equal(head["n"], [[0, 1, 2], [3, 4, 5]])

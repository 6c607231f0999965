"""`palpate topics`: all fields are listed, and the command that it proposes works when it is pasted."""

from __future__ import annotations

import json
import shlex
import tomllib
from pathlib import Path

import numpy as np
import pytest
from rosbags.rosbag2 import StoragePlugin, Writer
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from identification.synthetic_contacts import pressed
from logs.ros_bags import BEGIN, joints, pose, wrench, write_bag
from logs.test_laboratories import aurora, labview, saved
from palpate.cli import main
from palpate.errors import InputError
from palpate.logs import read_log, read_wrench_and_pose, write_record
from palpate.logs.listing import list_log
from palpate.logs.naming import read_name
from palpate.records import Record
from palpate.signals.rotations import matrices_from_quaternions

TIME = np.arange(300) / 100
MOVED = np.column_stack([TIME, np.cos(TIME), np.sin(TIME)])
MEASURED = [
    path
    for path in sorted(Path("../shared/data").resolve().glob("*/*"))
    if path.suffix in {".csv", ".mat", ".ddf"}
]

LACKING = {"ati_rdt.csv": "no position", "forces_only.csv": "no position"}
"""Logs of which nothing is identified, with what they lack."""


def marks(i):
    """Marks of a measured log's test."""
    return [pytest.mark.long] if i % 3 else []


BESIDE = {"--wrench-frame", "--robot-stiffness"}
"""Options that do not say how a log is read."""


def read_as_proposed(path):
    """Read a log by the words that are proposed for it, as `palpate identify` would."""
    proposal = list_log(path).proposal
    words = shlex.split(proposal.command(path))
    assert words[:3] == ["palpate", proposal.verb, str(path)]
    said = dict(zip(words[3::2], words[4::2], strict=True))
    said = {flag.removeprefix("--"): word for flag, word in said.items() if flag not in BESIDE}
    if "rate" in said:
        said["rate"] = float(said["rate"])
    return (read_wrench_and_pose if "wrench" in said else read_log)(path, **said)


@pytest.mark.parametrize(
    "path",
    [pytest.param(p, id=p.name, marks=marks(i)) for i, p in enumerate(MEASURED)],
)
def test_measured_logs_are_read_as_proposed(path):
    if path.name in LACKING:
        proposal = list_log(path).proposal
        assert proposal.options is None
        assert LACKING[path.name] in proposal.guesses[0]
        return
    record = read_as_proposed(path)
    if "force" not in record.columns:
        assert np.nanstd(record["force_z"]) > 0
        return
    assert np.nanstd(record["force"]) > 0


def test_the_example(root):
    proposal = list_log(root / "examples/data/press.csv").proposal
    assert proposal.words == ("--time", "time_s", "--position", "position_mm:mm", "--force", "force_N:N")
    assert not proposal.guesses


def press():
    flat = pressed()
    return flat["time"], flat["position"], flat["force"]


TABLES = {
    "no names": (lambda t, x, f: ("", (t, 1e3 * x, f)), "--time 0 --position 1:mm --force 2:N"),
    "milliseconds": (
        lambda t, x, f: ("time,x,f", (1e3 * t, x, f)),
        "--time time:ms --position x:m --force f:N",
    ),
    "no time": (
        lambda t, x, f: ("x_mm,Fz [N]", (1e3 * x, f)),
        "--rate 1000 --position x_mm:mm --force 'Fz [N]:N'",
    ),
    "names of one's own": (
        lambda t, x, f: ("stamp,-x,a:b,load", (t, 1e3 * x, 0 * t, f)),
        "--time stamp --position 1:mm --force load:N",
    ),
    "three axes": (
        lambda t, x, f: ("t,fx,fy,fz,x_mm,y_mm,z_mm", (t, 0.1 * f, 0.2 * f, f, 9 * x, 99 * x, 1e3 * x)),
        "--time t --wrench fx:N,fy:N,fz:N --pose x_mm:mm,y_mm:mm,z_mm:mm --wrench-frame base",
    ),
}


@pytest.mark.parametrize("kind", TABLES)
def test_tables(tmp_path, kind):
    make, words = TABLES[kind]
    header, columns = make(*press())
    path = tmp_path / "a log.csv"
    np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="", fmt="%.9g")
    if not header:
        path.write_text(path.read_text().lstrip("\n"))
    assert list_log(path).proposal.command(path) == f"palpate identify {shlex.quote(str(path))} {words}"
    assert len(read_as_proposed(path)) == len(columns[0])


@pytest.mark.parametrize(
    ("make", "words"),
    [
        (aurora, "--position AI0:mm --force AI1:mN"),
        (labview, "--time X_Value --position Path:mm --force Load:Newtons"),
    ],
)
def test_instruments(tmp_path, make, words):
    path = saved(tmp_path, make())
    assert list_log(path).proposal.command(path).endswith(words)
    assert len(read_as_proposed(path)) == 40


def test_bags(tmp_path):
    rolled = [
        wrench("/ft", TIME, MOVED),
        wrench("/ft_raw", TIME[::2], MOVED[::2]),
        pose("/pose", TIME, MOVED),
    ]
    path = write_bag(tmp_path / "two", "mcap", rolled)
    found = list_log(path).proposal
    assert found.words == ("--wrench", "/ft", "--pose", "/pose")
    assert "there are /ft, /ft_raw" in found.guesses[0]
    lift = joints("/joints", TIME, ["turn", "lift"], MOVED[:, :2], np.column_stack([0 * TIME, TIME]))
    path = write_bag(tmp_path / "joints", "mcap", [lift])
    assert list_log(path).proposal.words == (
        "--position",
        "/joints.position.lift:m",
        "--force",
        "/joints.effort.lift:N",
    )
    assert len(read_as_proposed(path)) == len(TIME)
    idle = joints("/joints", TIME, ["turn", "lift"], MOVED[:, :2], 0 * MOVED[:, :2])
    proposal = list_log(write_bag(tmp_path / "idle", "mcap", [idle])).proposal
    assert proposal.options is None
    assert "effort.turn never changes" in proposal.guesses[0]


def own_types(path, texts, sent):
    """A bag of messages of types of its own: topic, type and a function from a row's number to the message."""
    store = get_typestore(Stores.ROS2_HUMBLE)
    for kind, text in texts.items():
        store.register(get_types_from_msg(text, kind))
    with Writer(path, version=9, storage_plugin=StoragePlugin.MCAP) as writer:
        links = {topic: writer.add_connection(topic, kind, typestore=store) for topic, kind, _ in sent}
        for k in range(len(TIME)):
            for topic, kind, make in sent:
                when = BEGIN + round(1e9 * TIME[k])
                writer.write(links[topic], when, store.serialize_cdr(make(store.types, k, when), kind))
    return path


def header(types, when, frame):
    stamp = types["builtin_interfaces/msg/Time"](when // 10**9, when % 10**9)
    return types["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)


TURNS = np.array(
    [[0.1, 0.2, 0.3, 0.927], [0.9, 0.1, -0.2, 0.3], [0.1, 0.9, 0.3, -0.2], [-0.2, 0.1, 0.9, 0.1]]
)
TURNS /= np.linalg.norm(TURNS, axis=1)[:, None]


def franka(types, k, when):
    transform = np.eye(4)
    transform[:3, :3] = matrices_from_quaternions(np.arange(4.0), TURNS)[k % 4]
    transform[:3, 3] = MOVED[k]
    return types["franka_msgs/msg/FrankaState"](
        header(types, when, "base"), transform.flatten(order="F"), np.r_[MOVED[k], 0.1, 0.2, 0.3]
    )


def test_the_state_of_a_franka(tmp_path):
    text = "std_msgs/Header header\nfloat64[16] O_T_EE\nfloat64[6] O_F_ext_hat_K\n"
    kind = "franka_msgs/msg/FrankaState"
    path = own_types(tmp_path / "franka", {kind: text}, [("/state", kind, franka)])
    listing = list_log(path)
    assert listing.entries[0].about == "--wrench /state --pose /state"
    assert {"O_T_EE.15", "O_F_ext_hat_K.5"} <= set(listing.entries[0].fields)
    record = read_as_proposed(path)
    np.testing.assert_allclose(record["force_z"], MOVED[:, 2])
    np.testing.assert_allclose(record["position_y"], MOVED[:, 1])
    found = np.column_stack([record[f"quaternion_{axis}"] for axis in "xyzw"])
    np.testing.assert_allclose(np.abs((found * TURNS[np.arange(len(TIME)) % 4]).sum(axis=1)), 1.0)


def transforms(types, k, when):
    def one(parent, child, place):
        own = types["geometry_msgs/msg/Transform"](
            types["geometry_msgs/msg/Vector3"](*place),
            types["geometry_msgs/msg/Quaternion"](0.0, 0.0, 0.0, 1.0),
        )
        return types["geometry_msgs/msg/TransformStamped"](header(types, when, parent), child, own)

    found = [one("base", "camera", (1.0, 2.0, 3.0))] if k % 2 else []
    return types["tf2_msgs/msg/TFMessage"]([*found, one("base", "tool0", MOVED[k])])


def force(types, k, when):
    vector = types["geometry_msgs/msg/Vector3"]
    own = types["geometry_msgs/msg/Wrench"](vector(*MOVED[k]), vector(0.0, 0.0, 0.0))
    return types["geometry_msgs/msg/WrenchStamped"](header(types, when, "tool0"), own)


def test_frames_of_transforms(tmp_path):
    sent = [("/tf", "tf2_msgs/msg/TFMessage", transforms), ("/ft", "geometry_msgs/msg/WrenchStamped", force)]
    path = own_types(tmp_path / "tf", {}, sent)
    entries = {entry.name: entry for entry in list_log(path).entries}
    assert entries["/tf.tool0"].about == "--pose /tf.tool0 (in base)"
    assert (entries["/tf.tool0"].count, entries["/tf.camera"].count) == (300, 150)
    record = read_as_proposed(path)
    np.testing.assert_allclose(record["position_z"], MOVED[:, 2])
    assert record.meta["frames"]["position_x"] == "base"
    one = read_log(path, force="/ft.wrench.force.z", position="/tf.tool0.transform.translation.x")
    np.testing.assert_allclose(one["position"], MOVED[:, 0])


@pytest.mark.long
@pytest.mark.parametrize("names", [("c",), ("position_", "force_")])
def test_ten_thousand_columns(tmp_path, names):
    """Each column used to be looked for in the file by itself, and later to be compared with all others."""
    path = tmp_path / "wide.csv"
    rows = 1e-3 * np.arange(10)[:, None] ** (1 + np.arange(10_000) % 2) + np.arange(10_000)
    header = ",".join(f"{names[i % len(names)]}{i}" for i in range(10_000))
    np.savetxt(path, rows, delimiter=",", header=header, comments="", fmt="%.3f")
    listing = list_log(path)
    assert len(listing.entries) == 10_000
    assert all(entry.count == 10 for entry in listing.entries)
    assert listing.entries[7_000].about == "7000 to 7000.01"


def test_a_run_needs_no_words(tmp_path):
    columns = dict.fromkeys(("t", "x_measured", "force_sampled"), TIME)
    path = write_record(Record(columns, dict.fromkeys(columns, "s")), tmp_path / "record.parquet")
    assert list_log(path).proposal.command(path) == f"palpate identify {path}"


def test_names_that_a_terminal_would_obey(tmp_path, capsys):
    path = tmp_path / "log\x1b[2J.csv"
    path.write_text("t,\x1b]0;owned\x07x,f\n" + "".join(f"{k / 100},{k % 7},{k % 5}\n" for k in range(50)))
    assert main(["topics", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "\x1b" not in shown
    assert "\x07" not in shown
    assert "\\x1b]0;owned" in shown


def test_the_limits_are_options(tmp_path, capsys):
    path = saved(tmp_path, "t,x,f\n" + "1,2,3\n" * 500)
    assert main(["topics", str(path), "--max-size", "0.000001"]) == 2
    assert "--max-size" in capsys.readouterr().err
    words = [
        "identify",
        str(path),
        "--time",
        "t",
        "--position",
        "x",
        "--force",
        "f",
        "--max-size",
        "0.000001",
    ]
    assert main(words) == 2
    assert "more than 1e-06 GB" in capsys.readouterr().err
    assert main(["topics", str(path), "--json"]) == 0
    assert set(json.loads(capsys.readouterr().out)) == {
        "command", "options", "files", "version", "entries", "troubles", "identify", "others",
    }  # fmt: skip


def proposed(tmp_path, names, *columns):
    path = saved(
        tmp_path,
        "\n".join([names, *(",".join(f"{v:.6f}" for v in row) for row in zip(*columns, strict=True))]),
    )
    return list_log(path).proposal


def test_a_velocity_a_copy_and_another_device_are_no_position(tmp_path):
    """The force of a damper follows the velocity best, and a command goes where the probe goes."""
    rng = np.random.default_rng(0)
    t = np.arange(0, 8, 0.01)
    x = 5 * np.sin(2 * np.pi * t) + 0.01 * rng.standard_normal(len(t))
    f = 40 * np.sign(np.cos(2 * np.pi * t)) + 2 * x
    found = proposed(tmp_path, "t,dist,x_F.0,x_F.1,forc", t, x, x, np.gradient(x, t), f)
    assert (found.options["position"], found.options["force"]) == ("dist:mm", "forc:N")
    pressed_in = np.maximum(x, 0)
    found = proposed(
        tmp_path, "t,AI0_mm,AI1_mN,AO0_mm", t, x, pressed_in + 0.2 * rng.standard_normal(len(t)), x + 1
    )
    assert found.options["position"] == "AI0_mm:mm"


def test_rare_taps_are_a_force_that_follows(tmp_path):
    """In free motion, nine rows of ten, its ranks are those of noise."""
    t = np.arange(0, 9, 0.002)
    x = -5 + 6 * np.exp(-(((t % 1.5 - 0.7) / 0.08) ** 2))
    f = 8 * np.maximum(x, 0) + 0.01 * np.random.default_rng(0).standard_normal(len(t))
    assert proposed(tmp_path, "time_s,z_mm,fz_N", t, x, f).options["force"] == "fz_N:N"


@pytest.mark.parametrize("friction", [True, False])
def test_of_columns_without_names_the_one_whose_motion_two_others_follow_is_the_position(tmp_path, friction):
    """A friction and the pressure beside it move together more than either does with the stroke that causes both."""
    rng, t = np.random.default_rng(0), np.arange(4000) / 100
    x = 20.0 * np.sin(4.0 * t)
    follows = np.sign(np.cos(4.0 * t)) if friction else x / 20.0
    pressure, force = (size * (follows + 0.1 * rng.standard_normal(len(t))) for size in (0.05, 7.0))
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([t, 3.0 + pressure, x.round(3), 150.0 + force]), "%.4f", ",")
    proposal = list_log(path).proposal
    assert proposal.options["position"] == "2:mm"
    assert ("both follow the motion of '2'" in " ".join(proposal.guesses)) == friction


def test_six_columns_without_names_are_not_told_apart(tmp_path):
    """Three forces move together, and so do three places: which is which no number says."""
    t = np.arange(2000) / 100
    moves = [np.sin(a * t) + 0.1 * np.sin(7 * a * t) for a in (1.0, 1.1, 1.3)]
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([t, *moves, *(9 * np.maximum(move, 0) for move in moves)]), "%.4f", ",")
    proposal = list_log(path).proposal
    assert proposal.options is None
    assert "name both" in proposal.guesses[0]


def test_two_readings_of_one_quantity_are_no_position_and_force(tmp_path):
    """Two sensors of one pressure are equally rough, and so neither is the position."""
    rng, t = np.random.default_rng(1), np.arange(2000) / 100
    noise = 0.1 * rng.standard_normal((2, len(t)))
    assert proposed(tmp_path, "0,1,2", t, *(24 + np.sin(t) + noise)).options is None


def test_of_columns_without_names_a_slow_drift_is_no_position(tmp_path):
    """A temperature has a value of its own at each time, and so has each push: neither is the cause of the other."""
    t = np.arange(0, 60, 0.005)
    temperature = 20 + 3 * (1 - np.exp(-t / 40))
    x = 2e-3 * (1 - np.cos(2 * np.pi * t / 15)) - 1.5e-3
    f = 3000 * np.maximum(x, 0) + 0.02 * np.random.default_rng(0).standard_normal(len(t))
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([t, temperature, 1e3 * x, f]), delimiter=",")
    options = list_log(path).proposal.options
    assert (options["position"], options["force"].partition(":")[0]) == ("2:mm", "3")


def test_no_probe_travels_over_a_metre(tmp_path):
    """A load of two kilonewtons is smoother than the displacement that it follows, and is no position for that."""
    t = np.arange(2000) / 100
    x = 0.1 * np.sin(t) + 0.002 * np.random.default_rng(2).standard_normal(len(t))
    path = tmp_path / "log.csv"
    np.savetxt(path, np.column_stack([t, x, 2000 * np.sin(t)]), "%.5f", ",")
    proposal = list_log(path).proposal
    assert proposal.options is None
    assert "name both" in proposal.guesses[0]


def test_a_force_across_the_motion_is_not_its_friction(tmp_path):
    t = np.arange(2000) / 100
    x, across = np.sin(t), 100 * np.sign(np.cos(t)) + np.cos(50 * t)
    names = "TimeStamp,KNEE.PosX,FP1.{}"
    assert (
        proposed(tmp_path, names.format("ForX"), t, x, across).purpose == "identify the friction of the axis"
    )
    proposal = proposed(tmp_path, "t,a1_vel,a2_vel,a1_torque", t, np.cos(t), 0.3 * np.cos(t), across)
    assert "'a2_vel' moves with it" in proposal.facts[-1]
    for name in ("ForY", "MomX", "MomZ"):
        assert (
            proposed(tmp_path, names.format(name), t, x, across).purpose
            != "identify the friction of the axis"
        )


def turning(t):
    """Columns of a wrench in the tool's axes, and of a pose at one place that turns about x by 120 degrees in steps."""
    angle = np.radians(120) * np.floor(t * 0.7) / np.floor(t[-1] * 0.7)
    force = -9.0 * np.column_stack([0 * t, np.sin(angle), np.cos(angle)])
    turned = np.column_stack([np.sin(angle / 2), 0 * t, 0 * t, np.cos(angle / 2)])
    return [*force.T, *(0.1 * force.T), *np.full((3, len(t)), 0.3), *turned.T]


def test_a_log_lacks_what_it_lacks_and_leads_to_what_it_is_good_for(tmp_path):
    t = np.arange(600) / 50
    x = np.maximum(np.sin(t), 0)
    wrench = "t,fx,fy,fz,tx,ty,tz"
    proposal = proposed(tmp_path, f"{wrench},x,y,z,qx,qy,qz,qw", t, *turning(t))
    assert proposal.verb == "payload"
    assert proposal.fallback is None
    assert proposal.options["pose"] == "x:m,y:m,z:m,qx,qy,qz,qw"
    proposal = proposed(tmp_path, wrench, t, *turning(t)[:6])
    assert "no position that moves" in proposal.guesses[0]
    assert "palpate payload" in proposal.guesses[0]
    assert "no force" in proposed(tmp_path, "time,tip_z_mm,count,temperature", t, x, 9 * x, 20 + x).guesses[0]
    assert "joints" in proposed(tmp_path, "time,q_0,q_1,tau_0,tau_1", t, x, 2 * x, 3 * x, x**2).guesses[0]


def sliding(axes):
    """Columns of a tip that touches at -z, presses with 2 to 10 N and slides with mu 0.3 along x."""
    t = np.arange(0, 12, 4e-3)
    rng = np.random.default_rng(0)
    x = 0.02 * np.where(t > 3, np.sin(1.6 * (t - 3)), 0)
    z = np.interp(t, [0, 1, 2, 8, 11, 12], [5e-3, 5e-3, -1e-3, -2e-3, -4e-4, -4e-4])
    load = 5e3 * np.maximum(-z, 0)
    ahead = np.gradient(x, t)
    force = {"x": 0.3 * load * np.clip(ahead / 2e-3, -1, 1), "y": 0 * t, "z": -load}
    place = {"x": x, "y": 1e-3 * x, "z": z}
    return [
        t,
        *(force[a] + 0.02 * rng.standard_normal(len(t)) for a in axes),
        *(1e3 * place[a] for a in axes),
    ]


@pytest.mark.parametrize("axes", ["xyz", "xz"])
def test_a_slide_is_proposed_and_identified_as_one(tmp_path, capsys, axes):
    path = tmp_path / "slide.csv"
    names = ["time_s", *(f"f{a}_N" for a in axes), *(f"{a}_mm" for a in axes)]
    np.savetxt(path, np.column_stack(sliding(axes)), "%.6f", ",", header=",".join(names), comments="")
    assert main(["topics", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "to identify the friction of the slide in it" in shown
    assert ("fx_N:N,-,fz_N:N" in shown) == (axes == "xz")
    assert main(["identify", str(path), "--json"]) == 1
    answer = json.loads(capsys.readouterr().out)
    assert "--wrench-frame base" in answer["guessed"]["command"]
    low, high = answer["slide"]["friction"]["ci95"]
    assert low < 0.3 < high
    assert high - low < 0.05


@pytest.mark.parametrize(
    ("names", "motion"), [("t,qd,tau", "--velocity qd:rad/s"), ("t,q_rad,tau", "--position q_rad:rad")]
)
def test_a_force_against_the_motion_is_led_to_friction(tmp_path, capsys, names, motion):
    t = np.arange(0, 20, 4e-3)
    speed = 0.5 * np.sin(2.5 * t) + 0.2 * np.sin(0.9 * t)
    torque = 2 * np.sign(speed) + 3 * speed + 0.05 * np.random.default_rng(0).standard_normal(len(t))
    path = tmp_path / "joint.csv"
    moved = speed if "qd" in names else 4e-3 * np.cumsum(speed)
    np.savetxt(path, np.column_stack([t, moved, torque]), "%.6f", ",", header=names, comments="")
    command = f"palpate identify {path} --time t {motion} --force-column tau:Nm --friction"
    assert main(["topics", str(path)]) == 0
    assert (
        f"to identify the friction of the axis (guessed parts are listed below):\n  {command}"
        in capsys.readouterr().out
    )
    assert main(["identify", str(path)]) == 2
    assert command in capsys.readouterr().err
    assert main([*command.split()[1:], "--json"]) == 0
    low, high = json.loads(capsys.readouterr().out)["parameters"]["Fc"]["ci95"]
    assert low < 2 < high


@pytest.mark.parametrize(
    ("names", "pairs"),
    [
        ("time_s,ext_mm,load_N,time_s,ext_mm,load_N", [("1:mm", "2:N"), ("4:mm", "5:N")]),
        (
            "time_s,Displacement (mm),Load (N),time_s.1,Displacement (mm).1,Load (N).1",
            [("Displacement (mm):mm", "Load (N):N"), ("Displacement (mm).1:mm", "Load (N).1:N")],
        ),
        (
            "first time (s),first z (mm),first force (N),second time (s),second z (mm),second force (N)",
            [("first z (mm):mm", "first force (N):N"), ("second z (mm):mm", "second force (N):N")],
        ),
    ],
)
def test_logs_side_by_side_are_proposed_each_with_its_own_pair(tmp_path, names, pairs):
    names = names.replace("ext_mm", "extension_mm")
    t = np.arange(400) / 100
    x = 2 * np.maximum(np.sin(3 * t), 0)
    path = tmp_path / "log.csv"
    table = np.column_stack([t, x, 3 * x + 0.01 * np.cos(99 * t), t, 1.5 * x, x + 0.01 * np.sin(99 * t)])
    rows = [",".join(f"{v:.5f}" for v in row) for row in table]
    rows[300:] = [",".join([*row.split(",")[:3], "", "", ""]) for row in rows[300:]]
    path.write_text("\n".join([names, *rows]) + "\n")
    proposals = list_log(path).proposals
    assert [(p.options["position"], p.options["force"]) for p in proposals] == pairs
    second = {name: proposals[1].options[name] for name in ("time", "position", "force")}
    assert len(read_log(path, **second)) == 300
    with pytest.raises(InputError, match="holds 2 logs side by side; identify one"):
        read_log(path)


def test_branches_in_volts_take_gain_rate_and_cantilever_of_the_header(tmp_path):
    z = np.linspace(0, 1000, 400)
    volts = 0.002 * np.maximum(z - 500, 0)
    path = saved(
        tmp_path,
        "Force Constant, nN/nm:\t0.5\nLight Lever Gain, mV/nm:\t2.0\nZ Rate, nm/s:\t250\n\n"
        "Extend Z(nm),Extend T-B(V),Retract Z(nm),Retract T-B(V)\n"
        + "".join(
            f"{a:.4f},{b:.6f},{1000 - a:.4f},{c:.6f}\n" for a, b, c in zip(z, volts, volts[::-1], strict=True)
        ),
    )
    (both,) = list_log(path).proposals
    assert both.options == {
        "rate": "99.75",
        "position": "Z(nm):nm",
        "force": "T-B(V):N",
        "robot_stiffness": "0.5",
    }
    record = read_log(path, rate=99.75, position="Extend Z(nm):nm", force="Extend T-B(V)")
    assert record["force"].max() == pytest.approx(1.0 / 2e6 * 0.5)  # 1 V, 2 V/um, 0.5 N/m


def test_of_many_logs_side_by_side_the_first_and_their_number_are_listed(tmp_path, capsys):
    t = np.arange(300) / 100
    z = 2 * np.maximum(np.sin(2 * t), -0.5)
    noise = np.random.default_rng(0)
    names, columns = ["time (s)"], [t]
    for i in range(1, 21):
        names += [f"curve {i}.height (mm)", f"curve {i}.force (N)"]
        columns += [z, i * np.maximum(z, 0) + 0.01 * noise.standard_normal(len(t))]
    path = tmp_path / "map.csv"
    np.savetxt(path, np.column_stack(columns), "%.4f", ",", header=",".join(names), comments="")
    assert main(["topics", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "one of 20 logs side by side" in shown
    assert shown.count("palpate identify") == 1
    assert "38 more" in shown
    assert "curve 2" not in shown
    assert main(["identify", str(path)]) == 2
    assert "holds 20 logs side by side" in capsys.readouterr().err
    third = ["--time", "time (s)", "--position", "curve 3.height (mm)", "--force", "curve 3.force (N)"]
    assert main(["identify", str(path), *third, "--json"]) == 0
    low, high = json.loads(capsys.readouterr().out)["working_point"]["stiffness"]["ci95"]
    assert low < 3000 < high


@pytest.mark.parametrize("turned", [False, True])
def test_two_branches_are_one_press_with_its_adhesion(tmp_path, capsys, turned):
    """The second branch may be listed in the order of time, or of the place as the first."""
    z = np.linspace(0, 2000, 500)
    noise = 0.3 * np.random.default_rng(0).standard_normal((2, 500))
    pressed_in, leaves = (np.where(z > touch, 4 * (z - 1200), 0) for touch in (1200, 1150))
    way = slice(None, None, 1 if turned else -1)
    columns = np.column_stack([z, pressed_in + noise[0], z[way], (leaves + noise[1])[way]])
    path = tmp_path / "curve.csv"
    names = "Approach Z (nm),Approach Force (nN),Retract Z (nm),Retract Force (nN)"
    np.savetxt(path, columns, "%.4f", ",", header=names, comments="")
    options = ["--rate", "500", "--position", "Z (nm)", "--force", "Force (nN)"]
    assert main(["identify", str(path), *options, "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    low, high = answer["working_point"]["stiffness"]["ci95"]
    assert low < 4.0 < high
    assert answer["press"]["pull_off_N"] == pytest.approx(200e-9, rel=0.2)


def test_a_command_that_identify_refuses_is_not_printed(tmp_path, capsys):
    """Numbers that no measurement has are refused where they are read, not where names are looked at."""
    t = np.arange(300) / 100
    rows = (f"{a:.2f},{1e35 * np.sin(a):.6g},{np.sin(a):.4f}" for a in t)
    path = saved(tmp_path, "\n".join(["time_s,position_mm,force_N", *rows]))
    assert list_log(path).proposal.options is not None
    assert main(["topics", str(path)]) == 0
    shown = capsys.readouterr().out
    assert "palpate identify" not in shown
    assert "identify refuses what the names suggest" in shown


def test_repeated_stamps_are_a_time(tmp_path):
    t = np.repeat(np.arange(300) / 100, 3)
    x = np.maximum(np.sin(2 * np.arange(900) / 300), 0)
    proposal = proposed(tmp_path, "seq,stamp,z_mm,fz_N", np.arange(900) + 17, t, x, 5 * x)
    assert proposal.options["time"] == "stamp"
    assert proposal.options["position"] == "z_mm:mm"


KINDS = {
    "time": "t ts Zeit t_ms Time(sec) header.stamp tcp_force.time",
    "position": "z Pos_Z(mm) Extension tcp_x Crosshead[mm] Weg ee.pos.1 AI0_mm height~(measured) place",
    "force": "Fz Force_X Load fn Standardkraft wrench.2 weight_g TCPForceZ x_F.0 AI1_mN",
    "torque": "Tx tau_J[0] wrench.5 field.wrench.torque.z",
    "orientation": "qw rx roll pose.orientation.x angle_deg",
    "joint": "q_3 joint_1 jointPos_2",
    "other": "qd_0 acc_x vx RDT~Sequence Status(hex) temp_C pressure_kPa Position~Error T-B(V) O_T_EE[12] Post-Test~2",
}


@pytest.mark.parametrize("kind", KINDS)
def test_names_and_units_say_the_quantity(kind):
    for name in KINDS[kind].split(" "):
        assert read_name(name.replace("~", " ")).kind == kind, name


@pytest.mark.parametrize("name", ["AI0", "c1", "3", "-", "channel_a"])
def test_a_name_that_says_nothing_vetoes_nothing(name):
    assert read_name(name).kind is None


def test_the_table_of_public_files_is_complete():
    table = tomllib.loads((Path(__file__).parent / "public_files.toml").read_text(encoding="utf-8"))["file"]
    fields = {"repository", "path", "commit", "licence", "kind", "result", "wrong_roles"}
    assert len(table) >= 20
    assert len({entry["kind"] for entry in table}) >= 8
    assert all(entry.keys() == fields and len(entry["commit"]) == 40 for entry in table)
    assert {entry["wrong_roles"] for entry in table} <= {0, 1}

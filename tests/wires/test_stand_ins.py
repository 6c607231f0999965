"""The makers' own clients against the simulated controllers: what they ask is simulated, or refused by name."""

from __future__ import annotations

import math
import queue
import select
import socket
import struct
import subprocess
import sys
import threading
import time
from contextlib import contextmanager
from importlib.util import find_spec

import numpy as np
import pytest
from rtde_arm import RTDE, SCRIPT, Server
from rtde_controller import Controller
from tool_axis_arm import ToolAxisArm

from palpate.force import load_arm
from palpate.force.simulated_press import surface
from palpate.robots import SerialArm
from wires.slow_cell import ADDRESSES, PATIENCE, REHEARSAL


@contextmanager
def stand_in(module, address, *words):
    """A simulated controller in another process; yields what it writes on standard error, line by line, when asked."""
    command = [
        sys.executable,
        str(REHEARSAL / f"{module}.py"),
        "--address",
        address,
        "--seconds",
        "60",
        *words,
    ]
    pipes = {"stdout": subprocess.PIPE, "stderr": subprocess.PIPE, "text": True}
    with subprocess.Popen(command, **pipes) as process:
        try:
            assert select.select([process.stdout], [], [], PATIENCE)[0]
            process.stdout.readline()

            lines: queue.Queue[str] = queue.Queue()
            threading.Thread(target=lambda: [*map(lines.put, process.stderr)], daemon=True).start()

            def refused(word):
                """The next lines, up to one that has this word."""
                line = lines.get(timeout=PATIENCE)
                while word not in line:
                    line = lines.get(timeout=PATIENCE)
                return line

            yield refused
            assert process.poll() is None, "the stand-in has died"
        finally:
            process.kill()


class Client:
    """A client of RTDE by UR's guide, in the steps of UR's own Python client: ask, compare types, start, receive."""

    def __init__(self, address):
        self.socket = socket.create_connection((address, RTDE), PATIENCE)

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.socket.close()

    def ask(self, kind, body=b""):
        self.socket.sendall(struct.pack(">HB", 3 + len(body), ord(kind)) + body)
        while True:
            answer, found = self.receive()
            if answer == kind:
                return found

    def receive(self):
        head = self._exactly(3)
        size, kind = struct.unpack(">HB", head)
        return chr(kind), self._exactly(size - 3)

    def _exactly(self, count):
        data = b""
        while len(data) < count:
            more = self.socket.recv(count - len(data))
            assert more
            data += more
        return data


@pytest.fixture
def ur():
    """A simulated UR in this process, on a thread, for two of its seconds; its address and its controller."""
    address = next(ADDRESSES)
    controller = Controller(ToolAxisArm(load_arm("ur5e"), surface(5000.0, 20.0), 0.002, (0.0, 0.0, 3.0), 0))
    server = Server(address, controller)
    thread = threading.Thread(target=server.serve, args=(2.0,))
    thread.start()
    yield address, controller
    thread.join(PATIENCE)
    server.close()


@pytest.mark.real_time
def test_a_client_by_the_guide_reads_what_it_asks_for(ur):
    address, _ = ur
    with Client(address) as client, Client(address) as other:
        assert client.ask("V", struct.pack(">H", 1)) == b"\x00"  # simulated: the second protocol alone
        assert client.ask("V", struct.pack(">H", 2)) == b"\x01"
        assert struct.unpack(">4I", client.ask("v"))[0] == 5
        names = "timestamp,actual_q,actual_TCP_pose,actual_digital_input_bits,payload_cog,joint_mode,joint_temperatures"
        assert (
            client.ask("O", struct.pack(">d", 125.0) + b"timestamp,actual_temperature")[1:]
            == b"DOUBLE,NOT_FOUND"
        )
        kinds = client.ask("O", struct.pack(">d", 125.0) + names.encode())
        assert kinds[:1] != b"\x00"
        assert kinds[1:].decode() == "DOUBLE,VECTOR6D,VECTOR6D,UINT64,VECTOR3D,VECTOR6INT32,VECTOR6D"
        inputs = client.ask("I", b"input_double_register_0,input_int_register_0")
        assert inputs[1:] == b"DOUBLE,INT32"
        assert client.ask("I", b"actual_q") == b"\x00NOT_FOUND"
        assert other.ask("I", b"input_int_register_0") == b"\x00IN_USE"
        assert client.ask("S") == b"\x01"
        stamps = []
        while len(stamps) < 5:
            kind, body = client.receive()
            assert kind == "U"
            t, *numbers = struct.unpack(">d6d6dQ3d6i6d", body[1:])
            stamps.append(t)
        np.testing.assert_allclose(
            np.diff(stamps), 1 / 125, atol=1e-9
        )  # as asked for, of 500 readings a second
        q, pose = np.array(numbers[:6]), np.array(numbers[6:12])
        np.testing.assert_allclose(SerialArm.named("ur5e").forward_kinematics(q)[:3, 3], pose[:3], atol=1e-6)
        assert numbers[12] == 0
        assert numbers[16:22] == [253] * 6  # each joint runs
        assert np.isnan(numbers[22:]).all()  # not simulated


@pytest.mark.real_time
def test_a_script_that_is_not_ur_rtde_s_is_refused_by_name(ur, capsys):
    address, controller = ur
    controller.start_script()
    with socket.create_connection((address, SCRIPT)) as port:
        port.sendall(b"def mine():\n  movej([0, 0, 0, 0, 0, 0])\nend\n")
        for _ in range(round(PATIENCE / 0.01)):
            if not controller.running:
                break
            time.sleep(0.01)
    assert not controller.running
    assert "a script that is not ur-rtde's ('def mine()" in capsys.readouterr().err


REFUSED = {
    "moveJ": lambda c: c.moveJ([0.0] * 6),
    "moveL": lambda c: c.moveL([0.4, 0.0, 0.3, 3.14, 0.0, 0.0]),
    "setPayload": lambda c: c.setPayload(1.0, [0.0, 0.0, 0.1]),
    "setTcp": lambda c: c.setTcp([0.0] * 6),
    "teachMode": lambda c: c.teachMode(),
    "freedriveMode": lambda c: c.freedriveMode(),
    "jogStart": lambda c: c.jogStart([0.0, 0.0, 1.0, 0.0, 0.0, 0.0]),
    "moveUntilContact": lambda c: c.moveUntilContact([0.0, 0.0, -0.01, 0.0, 0.0, 0.0]),
    "forceModeStop": lambda c: c.forceModeStop(),
    "isPoseWithinSafetyLimits": lambda c: c.isPoseWithinSafetyLimits([0.4, 0.0, 0.3, 3.14, 0.0, 0.0]),
}
"""ur-rtde's commands that answer False."""
SENT = {
    "servoJ": lambda c: c.servoJ([0.0] * 6, 0.0, 0.0, 0.002, 0.1, 300.0),
    "servoC": lambda c: c.servoC([0.4, 0.0, 0.3, 3.14, 0.0, 0.0]),
    "speedJ": lambda c: c.speedJ([0.0] * 6),
    "forceMode": lambda c: c.forceMode(
        [0.0] * 6, [0, 0, 1, 0, 0, 0], [0.0, 0.0, -5.0, 0.0, 0.0, 0.0], 2, [0.1] * 6
    ),
    "directTorque": lambda c: c.directTorque([0.0] * 6),
    "speedL that turns": lambda c: c.speedL([0.0, 0.0, 0.0, 0.1, 0.0, 0.0], 1.0, 0.0),
    "servoL that turns": lambda c: c.servoL([0.4, 0.0, 0.3, 2.8, 0.0, 0.0], 0.0, 0.0, 0.002, 0.03, 300.0),
}
"""ur-rtde's commands whose end it does not wait for."""


def ur_rtde(address, refused, calls, sent):
    from rtde_control import RTDEControlInterface

    for name, call in calls.items():
        control = RTDEControlInterface(address)
        assert call(control) is sent, name
        assert name.partition(" ")[0] in refused("is not simulated")
        time.sleep(0.1)
        assert not control.isProgramRunning()
        assert not control.speedL([0.0] * 6, 1.0, 0.0)  # and so is all that comes after
        control.disconnect()


@pytest.mark.real_time
def test_each_command_of_ur_rtde_is_simulated_or_refused_by_name():
    pytest.importorskip("rtde_control", reason="ur-rtde has no wheel for this system")
    from rtde_control import RTDEControlInterface
    from rtde_receive import RTDEReceiveInterface

    address = next(ADDRESSES)
    with stand_in("rtde_arm", address) as refused:
        ur_rtde(address, refused, REFUSED, False)
        ur_rtde(address, refused, SENT, True)
        control, receive = RTDEControlInterface(address), RTDEReceiveInterface(address)
        assert control.isSteady()
        assert control.zeroFtSensor()
        assert control.getTCPOffset() == [0.0] * 6
        x, _, z = receive.getActualTCPPose()[:3]
        assert control.getForwardKinematics()[:3] == pytest.approx([x, 0.0, z], abs=1e-6)
        for answer, wanted in (
            (control.getStepTime, 0.002),
            (control.getActualToolFlangePose, [x, 0.0, z, math.pi, 0.0, 0.0]),
        ):
            answer()  # ur-rtde reads the register before it is written
            time.sleep(0.2)
            assert answer() == pytest.approx(wanted, abs=1e-6)
        assert control.speedL([0.02, 0.0, -0.005, 0.0, 0.0, 0.0], 1.0, 0.0)
        time.sleep(0.5)
        control.speedStop(1.0)
        there = receive.getActualTCPPose()[:3]
        assert 0.005 < there[0] - x < 0.03  # along the surface, too
        assert -0.006 < there[2] - z < -0.001
        control.disconnect()
        receive.disconnect()


def franka_robot(address):
    library = pytest.importorskip("pylibfranka", reason="pylibfranka has no wheel for this system")
    pytest.importorskip("franky_sim", reason="franky-sim is not installed")
    return library, lambda: library.Robot(address, library.RealtimeConfig.kIgnore)


@pytest.mark.real_time
def test_libfranka_is_refused_by_name_and_the_stand_in_lives():
    library, connect = franka_robot(address := next(ADDRESSES))
    with stand_in("franka_arm", address, "--gap", "0.05") as refused:
        mode = library.ControllerMode.JointImpedance
        robot = connect()
        state = robot.read_once()
        flange = SerialArm.named("fr3").forward_kinematics(np.array(state.q))
        np.testing.assert_allclose(np.reshape(state.O_T_EE, (4, 4)).T, flange, atol=1e-5)
        for start, words in (
            (robot.start_torque_control, ()),
            (robot.start_joint_position_control, (mode,)),
            (robot.start_joint_velocity_control, (mode,)),
            (robot.start_cartesian_pose_control, (mode,)),
        ):
            with pytest.raises(Exception, match="Move command aborted"):
                start(*words)
            assert "is not simulated: Cartesian velocities alone" in refused("not simulated")
        # The settings of libfranka's examples are those of the arm; others would change what is simulated.
        robot.set_joint_impedance([3000.0, 3000.0, 3000.0, 2500.0, 2500.0, 2000.0, 2000.0])
        robot.set_cartesian_impedance([3000.0, 3000.0, 3000.0, 300.0, 300.0, 300.0])
        with pytest.raises(Exception, match="rejected: invalid argument"):
            robot.set_load(1.0, [0.0, 0.0, 0.1], [0.0] * 9)
        assert "SetLoad" in refused("SetLoad")
        with pytest.raises(Exception, match="rejected: invalid argument"):
            robot.set_joint_impedance([1000.0] * 7)
        assert "SetJointImpedance" in refused("Impedance")
        robot.automatic_error_recovery()
        robot = start = None  # libfranka lets go
        # Version 5 of the protocol is that of libfranka 0.9, which a Panda speaks.
        with socket.create_connection((address, 1337)) as other:
            other.sendall(struct.pack("<IIIHH", 0, 1, 16, 5, 4000))
            assert struct.unpack("<IIIHH4x", other.recv(100))[3:] == (1, 10)
        assert "version 5 of the protocol is not" in refused("version")


@pytest.mark.real_time
def test_a_motion_by_libfranka_moves_and_a_turning_one_is_a_reflex():
    library, connect = franka_robot(address := next(ADDRESSES))

    def drive(robot, ticks, *speeds):
        control = robot.start_cartesian_velocity_control(library.ControllerMode.JointImpedance)
        for i in range(ticks):
            control.readOnce()
            command = library.CartesianVelocities(
                [min(i / 100, 1.0, (ticks - i - 1) / 100) * v for v in speeds]
            )
            command.motion_finished = i == ticks - 1
            control.writeOnce(command)

    with stand_in("franka_arm", address, "--gap", "0.05") as refused:
        robot = connect()
        before = np.array(robot.read_once().O_T_EE[12:15])
        drive(robot, 600, 0.02, 0.0, -0.01, 0.0, 0.0, 0.0)
        time.sleep(0.5)
        way = np.array(robot.read_once().O_T_EE[12:15]) - before
        np.testing.assert_allclose(way, [0.01, 0.0, -0.005], atol=1e-3)
        with pytest.raises(Exception, match="motion aborted by reflex"):
            drive(robot, 400, 0.0, 0.0, 0.0, 0.1, 0.0, 0.0)
        assert "turns the tool" in refused("turns")
        robot.set_collision_behavior(
            [20.0] * 7, [20.0] * 7, [0.5] * 6, [0.5] * 6
        )  # the sensor shows 1 N at rest
        with pytest.raises(Exception, match="motion aborted by reflex"):
            drive(robot, 400, 0.0, 0.0, 0.001, 0.0, 0.0, 0.0)
        assert "upper threshold" in refused("upper")


@pytest.mark.real_time
def test_a_master_that_halts_ends_by_the_error_that_libfranka_names():
    library, connect = franka_robot(address := next(ADDRESSES))
    with stand_in("franka_arm", address) as refused:
        robot = connect()
        control = robot.start_cartesian_velocity_control(library.ControllerMode.JointImpedance)
        with pytest.raises(Exception, match="communication_constraints_violation"):
            for tick in range(200):
                control.readOnce()
                control.writeOnce(library.CartesianVelocities([0.0] * 6))
                time.sleep(0.1 * (tick == 100))
        assert "in a row are missing" in refused("missing")


FRANKY = """
import sys, time, franky
from franky import Affine, CartesianMotion, CartesianVelocityMotion, Duration, JointStopMotion, JointVelocityMotion
from franky import ReferenceType, TorqueStopMotion, Twist
robot = franky.Robot(sys.argv[1], realtime_config=franky.RealtimeConfig.Ignore)
robot.relative_dynamics_factor = 0.05
robot.recover_from_errors()
before = robot.state.O_T_EE.translation
for motion in (
    CartesianMotion(Affine([0.0, 0.0, -0.001]), ReferenceType.Relative),
    JointVelocityMotion([0.1] + [0.0] * 6, duration=Duration(200)),
    JointStopMotion(),
    TorqueStopMotion(),
):
    try:
        robot.move(motion)
        print("moved")
    except franky.CommandException as error:
        print(error)
print(robot.state.O_T_EE.translation[2] - before[2])
robot.move(CartesianVelocityMotion(Twist([0.0, 0.0, -0.01]), duration=Duration(1000)))
time.sleep(0.5)
print(robot.state.O_T_EE.translation[2] - before[2])
"""
"""In a process of its own: franky and pylibfranka do not live in one."""


@pytest.mark.real_time
def test_the_motions_of_franky_move_or_are_refused():
    pytest.importorskip("franky_sim", reason="franky-sim is not installed")
    if find_spec("franky") is None:
        pytest.skip("franky-control is not installed")
    with stand_in("franka_arm", address := next(ADDRESSES), "--gap", "0.05") as refused:
        command = [sys.executable, "-c", FRANKY, address]
        said = subprocess.run(
            command, capture_output=True, text=True, timeout=PATIENCE, check=True
        ).stdout.splitlines()
        assert said[:4] == ["libfranka: Move command aborted!"] * 4
        for asked in ("CartesianPosition", "JointVelocity", "JointPosition", "ExternalController"):
            assert asked in refused("is not simulated")
    still, way = map(float, said[4:])
    assert abs(still) < 1e-6
    assert -0.011 < way < -0.002

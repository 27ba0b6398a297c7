"""Holds the virtual servos to the maker's own library: its packets are understood, and it understands the answers.

Not part of the test suite, which needs no Python packages. To run it:

    python3 -m venv /tmp/dxl && /tmp/dxl/bin/pip install dynamixel-sdk
    cargo build -p locoman-sim --example servo_bus
    /tmp/dxl/bin/python sim/scripts/servo_bus.py target/debug/examples/servo_bus
"""

import subprocess
import sys
import time

from dynamixel_sdk import COMM_SUCCESS, GroupSyncRead, GroupSyncWrite, PacketHandler, PortHandler

MODEL = 1220
IDS = range(1, 9)
TORQUE_ENABLE, GOAL_CURRENT, GOAL_POSITION, PRESENT_POSITION = 64, 102, 116, 132


def checked(outcome):
    """The value of a read or the nothing of a write, after looking at result and error."""
    *value, result, error = outcome
    assert (result, error) == (COMM_SUCCESS, 0), outcome
    return value[0] if value else None


def main(virtual_bus):
    bus = subprocess.Popen([virtual_bus], stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
    try:
        port = PortHandler(bus.stdout.readline().strip())
        assert port.openPort() and port.setBaudRate(1_000_000)
        packets = PacketHandler(2.0)

        found, result = packets.broadcastPing(port)
        assert result == COMM_SUCCESS and sorted(found) == list(IDS), found
        assert all(model == MODEL for model, _ in found.values()), found
        assert checked(packets.ping(port, 3)) == MODEL

        # Kept registers are locked while the torque is on; the answer says why.
        checked(packets.write1ByteTxRx(port, 1, TORQUE_ENABLE, 1))
        result, error = packets.write1ByteTxRx(port, 1, 11, 3)
        assert (result, error & 0x7F) == (COMM_SUCCESS, 7), (result, error)

        start = {servo: checked(packets.read4ByteTxRx(port, servo, PRESENT_POSITION)) for servo in IDS}
        goals = {servo: start[servo] + 100 for servo in IDS}
        write = GroupSyncWrite(port, packets, GOAL_POSITION, 4)
        for servo, goal in goals.items():
            checked(packets.write1ByteTxRx(port, servo, TORQUE_ENABLE, 1))
            checked(packets.write2ByteTxRx(port, servo, GOAL_CURRENT, 900))
            assert write.addParam(servo, goal.to_bytes(4, "little", signed=True))
        assert write.txPacket() == COMM_SUCCESS
        time.sleep(0.5)

        read = GroupSyncRead(port, packets, PRESENT_POSITION, 4)
        for servo in IDS:
            assert read.addParam(servo)
        for name, exchange in [("sync read", read.txRxPacket), ("fast sync read", getattr(read, "fastSyncRead", None))]:
            if exchange is None:
                print(f"{name}: not in this version of the library")
                continue
            assert exchange() == COMM_SUCCESS, name
            for servo, goal in goals.items():
                position = read.getData(servo, PRESENT_POSITION, 4)
                assert abs(position - goal) <= 2, (name, servo, position, goal)
            print(f"{name}: all eight servos are where they were sent")

        checked(packets.reboot(port, 2))
        assert checked(packets.read1ByteTxRx(port, 2, TORQUE_ENABLE)) == 0
        print("ping, scan, read, write, sync write, reboot: understood both ways")
    finally:
        bus.stdin.close()
        bus.wait(5)


if __name__ == "__main__":
    main(sys.argv[1])

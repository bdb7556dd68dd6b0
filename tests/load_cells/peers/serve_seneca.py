# SPDX-License-Identifier: GPL-3.0-or-later
"""A pymodbus server with the registers of a Seneca ZE-SG3: serve_seneca.py tcp:PORT|rtu GROSS_KG TARE_KG.

Prints the port, or the serial device to open, in one line when it is about to serve.
"""
import os
import struct
import sys
import threading
import tty

from pymodbus.datastore import ModbusSequentialDataBlock, ModbusServerContext, ModbusSlaveContext
from pymodbus.server import StartSerialServer, StartTcpServer
from pymodbus.transaction import ModbusRtuFramer

UNIT, REGISTERS = 1, 100


def words(number):
    return list(struct.unpack(">HH", struct.pack(">f", number)))


def bridge(source, target):
    while True:
        os.write(target, os.read(source, 512))


def connected_terminals():
    """Two pseudo-terminals whose far ends copy to each other, as a serial cable would."""
    ends = [os.openpty() for _ in range(2)]
    for _, device in ends:
        tty.setraw(device)
    for source, target in ((0, 1), (1, 0)):
        threading.Thread(target=bridge, args=(ends[source][0], ends[target][0]), daemon=True).start()
    return [os.ttyname(device) for _, device in ends]


gross, tare = float(sys.argv[2]), float(sys.argv[3])
registers = [0] * REGISTERS
registers[63:69] = words(gross - tare) + words(gross) + words(tare)
registers[77] = 1 << 4
slave = ModbusSlaveContext(hr=ModbusSequentialDataBlock(1, registers))
context = ModbusServerContext(slaves={UNIT: slave}, single=False)
kind, _, port = sys.argv[1].partition(":")
if kind == "tcp":
    print(port, flush=True)
    StartTcpServer(context=context, address=("127.0.0.1", int(port)))
else:
    ours, theirs = connected_terminals()
    print(theirs, flush=True)
    StartSerialServer(context=context, framer=ModbusRtuFramer, port=ours, baudrate=115200, timeout=0.05)

# SPDX-License-Identifier: GPL-3.0-or-later
"""Reads the registers of a Laumas TLB with pymodbus, tares it, reads again: read_laumas.py tcp:PORT|rtu:DEVICE.

Prints two JSON lists of the registers 6 to 10.
"""
import asyncio
import json
import sys

from pymodbus.client import AsyncModbusSerialClient, AsyncModbusTcpClient

FIRST, COUNT, UNIT, COMMAND, TARE = 6, 5, 1, 5, 7


async def main():
    kind, place = sys.argv[1].split(":", 1)
    if kind == "tcp":
        client = AsyncModbusTcpClient("127.0.0.1", port=int(place), timeout=2)
    else:
        client = AsyncModbusSerialClient(place, baudrate=115200, timeout=2)
    await client.connect()
    calls = getattr(client, "protocol", None) or client
    before = await calls.read_holding_registers(FIRST, COUNT, slave=UNIT)
    # pymodbus sends at once; the amplifier wants 3.5 characters of silence first.
    await asyncio.sleep(0.01)
    written = await calls.write_registers(COMMAND, [TARE], slave=UNIT)
    assert not written.isError(), written
    await asyncio.sleep(0.01)
    after = await calls.read_holding_registers(FIRST, COUNT, slave=UNIT)
    print(json.dumps(before.registers))
    print(json.dumps(after.registers))


asyncio.run(main())

# SPDX-License-Identifier: GPL-3.0-or-later
"""Drives the first Tic and the LAC through pyusb, from the makers' documents and not from our code."""
import struct
import sys
import time

import usb.core
import usb.util

tics = sorted(usb.core.find(find_all=True, idVendor=0x1FFB), key=lambda d: d.serial_number)
assert [d.serial_number for d in tics] == ["%08d" % (i + 1) for i in range(7)], tics
assert {d.idProduct for d in tics} == {0xB3, 0xB5, 0xBD, 0xC3, 0xC9, 0xCB}
assert tics[0].manufacturer == "Pololu Corporation"
assert tics[4].product == "Tic T249"
tic = tics[0]


def quick(code):
    tic.ctrl_transfer(0x40, code, 0, 0)


def variable(offset, form):
    return struct.unpack(form, tic.ctrl_transfer(0xC0, 0xA1, 0, offset, struct.calcsize(form)))[0]


assert struct.unpack("<H", tic.ctrl_transfer(0xC0, 0xA8, 0, 0x09, 2)) == (1000,)
assert variable(0x00, "<B") == 2 and variable(0x02, "<H") & 0x81 == 0x81
assert variable(0x33, "<H") == 12000
quick(0x85)
quick(0x83)
assert variable(0x00, "<B") == 10 and variable(0x02, "<H") == 0
tic.ctrl_transfer(0x40, 0xEC, (-50) & 0xFFFF, 0xFFFF)
assert variable(0x22, "<i") == -50
tic.ctrl_transfer(0x40, 0xE0, 50, 0)
time.sleep(0.3)
assert variable(0x26, "<i") > 0
for _ in range(20):
    quick(0x8C)
    time.sleep(0.1)
    if variable(0x22, "<i") == 50 and variable(0x26, "<i") == 0:
        break
assert variable(0x22, "<i") == 50 and variable(0x26, "<i") == 0
time.sleep(1.1)
assert variable(0x02, "<H") == 0xC0, "command time-out and safe start after a second of silence"
try:
    tic.ctrl_transfer(0xC0, 0xA1, 0, 0x55, 1)
    sys.exit("reading beyond the last variable must be refused")
except usb.core.USBError as error:
    assert error.errno == 32, error

lac = usb.core.find(idVendor=0x04D8, idProduct=0xFC5F)


def ask(code, value):
    lac.write(0x01, struct.pack("<BH", code, value))
    code_back, value_back = struct.unpack("<BH", lac.read(0x81, 3))
    assert code_back == code
    return value_back


assert ask(0x10, 0) == 300
ask(0x21, 1023)
assert ask(0x20, 310) == 300
time.sleep(0.3)
assert ask(0x10, 0) == 310

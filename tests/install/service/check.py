#!/usr/bin/python3
"""The checks of service_check.sh, as root in its machine: posed@stage as systemd runs it.

Prints a line that begins with ok or FAIL for each, and at the end LAB PASSED and the part's name.
The part is `check=` of the kernel's command line: "service", or "reboot" after it.
"""
import contextlib
import ctypes
import glob
import json
import os
import pathlib
import re
import shutil
import signal
import sqlite3
import subprocess
import sys
import termios
import time
import tty

import posed

UNIT = "posed@stage"
TAKES = "/var/lib/posed/takes"
KEYS = "/etc/posed/keys"
SECOND_NS = 1_000_000_000
# Threads that the watchdog does not see: they wait for devices, peers or a full journal, and no
# frame waits for them. "posed" is the main thread, which gives the signs of life.
UNWATCHED = re.compile(r"ZMQbg/.*|posed-log|posed-guard|posed-link|posed-cpu|posed-teach|posed-takes|"
                       r"posed-clips|posed-upstream|dev-.*|posed")

failed = []


def check(right, text):
    print(("ok " if right else "FAIL ") + text)
    if not right:
        failed.append(text)
    return right


def run(*words):
    return subprocess.run(words, capture_output=True, text=True, check=False)


def shown(name, unit=UNIT):
    return run("systemctl", "show", "-P", name, unit).stdout.strip()


def main_pid():
    return int(shown("MainPID"))


def journal(*words):
    run("journalctl", "--sync")
    lines = run("journalctl", "-o", "json", "--no-pager", *words).stdout.splitlines()
    return [json.loads(line) for line in lines]


def comes(condition, within_s):
    end = time.monotonic() + within_s
    while not condition():
        if time.monotonic() > end:
            return False
        time.sleep(0.05)
    return True


class Viewer:
    """A client that stays connected while posed ends and begins."""

    def __init__(self, stream="walker", name="viewer"):
        self.client = posed.Client(streams=[stream], key=f"{KEYS}/{name}.key",
                                   server_key=f"{KEYS}/server.pub", queue=1000)

    def frame_after(self, time_ns, within_s=30):
        """When the first frame of an arrival after time_ns came; None if none did."""
        with contextlib.suppress(posed.PosedError):
            for frame in self.client.frames(timeout_s=within_s):
                if frame.message.arrival_ns > time_ns:
                    return time.monotonic_ns()
        return None

    def flows(self, within_s=30):
        return self.frame_after(time.monotonic_ns(), within_s) is not None


def threads(pid):
    """Thread ids by name."""
    found = {}
    for task in glob.glob(f"/proc/{pid}/task/*"):
        found[pathlib.Path(task, "comm").read_text().strip()] = int(os.path.basename(task))
    return found


def stop_thread(thread):
    """Stops one thread by ptrace until it ends; a child does, because who traces has to wait."""
    read_end, write_end = os.pipe()
    if os.fork() == 0:
        libc = ctypes.CDLL(None)
        libc.ptrace.argtypes = [ctypes.c_long] * 4
        seize, interrupt, every_kind = 0x4206, 0x4207, 0x40000000
        if libc.ptrace(seize, thread, 0, 0) != 0 or libc.ptrace(interrupt, thread, 0, 0) != 0:
            os._exit(1)
        os.waitpid(thread, every_kind)
        os.write(write_end, b"x")
        while True:
            _, status = os.waitpid(thread, every_kind)
            if os.WIFEXITED(status) or os.WIFSIGNALED(status):
                os._exit(0)
    os.close(write_end)
    stopped = os.read(read_end, 1) == b"x"
    os.close(read_end)
    return stopped


def newest_log():
    return max(glob.glob(f"{TAKES}/*.plog"))


def last_recorded_ns(log):
    """When the walker's last measurement in a log arrived, read from a copy."""
    for file in glob.glob(log + "*"):
        shutil.copy(file, "/run/" + os.path.basename(file).replace(os.path.basename(log), "copy.plog"))
    with contextlib.closing(sqlite3.connect("/run/copy.plog")) as database:
        return database.execute("SELECT max(arrival_ns) FROM chunk JOIN source ON source = source.id "
                                "WHERE name = 'walker'").fetchone()[0] or 0


def log_is_whole(what, log, until_ns, end):
    """It replays bit for bit, and lacks at most the last half second before that time."""
    replay = run("posed", "replay", log, "--speed", "max", "--expect")
    missing_s = (until_ns - last_recorded_ns(log)) / SECOND_NS
    if not check(replay.returncode == 0 and missing_s < 0.5,
                 f"{what}: its log replays bit for bit and lacks the last {missing_s:.2f} s before {end}"):
        print(replay.stderr)


def restarts(what, viewer, stop, named, recording_ends=False):
    """posed is stopped in some way; within 10 s a new one gives frames again.

    stop(pid) stops it; `named` is what the journal says then. recording_ends: at the stop, not only
    when systemd ends posed.
    """
    if not check(viewer.flows(), f"{what}: frames come before it is stopped"):
        return
    pid, log, before = main_pid(), newest_log(), int(shown("NRestarts"))
    since_s = time.time()
    stop_ns = time.monotonic_ns()
    if not check(stop(pid) is not False, f"{what}: stopped"):
        return
    if not comes(lambda: not os.path.exists(f"/proc/{pid}"), 30):
        check(False, f"{what}: systemd does not end posed within 30 s")
        os.kill(pid, signal.SIGKILL)
    gone_ns = time.monotonic_ns()
    again_ns = viewer.frame_after(gone_ns)
    again_s = ((again_ns or 2**62) - stop_ns) / SECOND_NS
    check(again_s < 10, f"{what}: ended after {(gone_ns - stop_ns) / SECOND_NS:.2f} s, frames again "
          f"after {again_s:.2f}")
    check(int(shown("NRestarts")) == before + 1 and main_pid() != pid, f"{what}: started again once")
    lines = [line["MESSAGE"] for line in journal("-u", UNIT, f"--since=@{since_s:.3f}")]
    if not check(any(named in line for line in lines), f"{what}: the journal says: {named}"):
        print("\n".join(lines))
    if recording_ends:
        log_is_whole(what, log, stop_ns, "it was stopped")
    else:
        log_is_whole(what, log, gone_ns, "systemd ended posed")


def each_thread_stopped(viewer):
    names = sorted(name for name in threads(main_pid()) if not UNWATCHED.fullmatch(name))
    check(len(names) == 9, "watched threads: " + " ".join(names))
    for name in names:
        restarts(f"thread {name}", viewer, lambda pid, name=name: stop_thread(threads(pid)[name]),
                 f"the thread {name} is stuck",
                 recording_ends=name in ("posed-reader", "posed-record"))
    restarts("the main thread", viewer, stop_thread, "Watchdog timeout")
    restarts("the whole process", viewer, lambda pid: os.kill(pid, signal.SIGSTOP),
             "Watchdog timeout", recording_ends=True)
    restarts("kill -9", viewer, lambda pid: os.kill(pid, signal.SIGKILL), "status=9/KILL",
             recording_ends=True)


def start():
    begin = time.monotonic()
    started = run("systemctl", "start", UNIT)
    took = time.monotonic() - begin
    pid = main_pid()
    check(started.returncode == 0 and shown("ActiveState") == "active" and pid > 0,
          f"systemctl start returns when posed is ready, after {took:.2f} s{started.stderr}")
    with open(f"/proc/{pid}/net/tcp", encoding="ascii") as file:
        listening = {int(line.split()[1].split(":")[1], 16) for line in list(file)[1:]
                     if line.split()[3] == "0A"}
    check({5570, 5571, 5572} <= listening, f"its endpoints are bound then: {sorted(listening)}")
    check(comes(lambda: re.fullmatch(r"[12] of 2 streams live.*", shown("StatusText")), 10),
          "systemctl status says: " + shown("StatusText"))
    return pid


def rights(pid):
    status = dict(line.split(":", 1) for line in
                  pathlib.Path(f"/proc/{pid}/status").read_text().splitlines())
    user = run("id", "-u", "posed").stdout.strip()
    check(set(status["Uid"].split()) == {user}, "posed runs as the user posed")
    check(int(status["CapEff"], 16) == 0, "it has no capability")
    locked_kb, used_kb = (int(status[name].split()[0]) for name in ("VmLck", "VmRSS"))
    check(locked_kb > used_kb > 0, f"its memory is locked: {used_kb} kB are in use")
    wanted = {"posed-reader": 12, "posed-pipeline": 11, "posed-publish": 10}
    found = {name: os.sched_getparam(thread).sched_priority
             for name, thread in threads(pid).items()
             if os.sched_getscheduler(thread) & 0xff == os.SCHED_FIFO}
    check(found == wanted, f"SCHED_FIFO: {found}")
    security = run("systemd-analyze", "security", "--no-pager", UNIT).stdout
    level = float(re.search(r"exposure level for .*: ([0-9.]+)", security).group(1))
    check(level <= 1.5, f"systemd-analyze security: {level}")


def reload(pid):
    late = Viewer(name="late")
    check(not late.flows(3), "a client whose key is not in the list gets no frame")
    with open("/etc/posed/stage.toml", "a", encoding="utf-8") as config:
        config.write('\n[[security.client]]\nname = "late"\npublic_key = "keys/late.pub"\n'
                     'rights = ["subscribe"]\n')
    done = run("systemctl", "reload", UNIT)
    check(done.returncode == 0 and main_pid() == pid,
          f"systemctl reload keeps the process{done.stderr}")
    late = Viewer(name="late")
    check(late.flows(10), "after systemctl reload the new client gets frames")
    late.client.close()


def plug_port():
    """A serial glove is plugged in that takes no bytes and sends none until a program opens its side."""
    # LucidGloves on a CP210x; cdc_acm drives it nevertheless, as it says that it is a modem.
    plugged = run("modprobe", "g_serial", "idVendor=0x10c4", "idProduct=0xea60")
    check(comes(lambda: os.path.exists("/dev/ttyACM0"), 10),
          f"a serial glove is plugged in{plugged.stderr}")


def plug_glove():
    """A glove is plugged in for the first time since the machine began; returns the process that plays it."""
    run("modprobe", "dummy_hcd")
    plug_port()
    child = os.fork()
    if child == 0:
        port = os.open("/dev/ttyGS0", os.O_RDWR | os.O_NOCTTY | os.O_NONBLOCK)
        tty.setraw(port, termios.TCSANOW)
        while True:
            with contextlib.suppress(BlockingIOError):
                os.write(port, b"A100B200C300D400E500F2047G2047\n")
                os.read(port, 4096)
            time.sleep(0.03)
    return child


def device(pid):
    known = pathlib.Path("/proc/devices").read_text().split()
    kinds = {"ttyUSB", "ttyACM", "hidraw", "usb_device"}
    check(kinds <= set(known), "the kernel knows all kinds of gloves before one is plugged in")
    glove = plug_glove()
    viewer = Viewer("glove")
    if not check(viewer.flows(10), "posed opens the glove, the first that is plugged in, after it began"):
        print("\n".join(line["MESSAGE"] for line in journal("-u", UNIT)[-10:]))
    facts = run("udevadm", "info", "--query=property", "/dev/ttyACM0").stdout
    check("ID_MM_DEVICE_IGNORE=1" in facts and "uaccess" in facts, "the udev rules know the glove")
    check(not open_in_unit(pid, "/dev/pmem0"), "the unit cannot open another device (a disk)")
    viewer.client.close()
    return glove


def port_of_glove_is_open(pid):
    for link in glob.glob(f"/proc/{pid}/fd/*"):
        with contextlib.suppress(FileNotFoundError):
            if os.readlink(link) == "/dev/ttyACM0":
                return True
    return False


def glove_that_hangs(viewer, glove):
    """It is plugged in again and takes no bytes, so Linux would keep closing its port for 30 s."""
    os.kill(glove, signal.SIGKILL)
    os.waitpid(glove, 0)
    run("modprobe", "-r", "g_serial")
    plug_port()
    check(comes(lambda: port_of_glove_is_open(main_pid()), 60),
          "a glove that hangs: posed asks it, and it takes nothing")
    # posed asks for 3 s, closes the port for 30 s and asks again: then, 4 to 5 s later, systemd ends it.
    time.sleep(30.5)
    restarts("a thread, while posed asks a glove that hangs", viewer,
             lambda pid: stop_thread(threads(pid)["posed-control"]),
             "the thread posed-control is stuck")


def open_in_unit(pid, path):
    """Whether root may open a device from within the unit's cgroup."""
    group = pathlib.Path(f"/proc/{pid}/cgroup").read_text().strip().split("::")[1]
    child = os.fork()
    if child == 0:
        pathlib.Path(f"/sys/fs/cgroup{group}/cgroup.procs").write_text(str(os.getpid()))
        try:
            os.close(os.open(path, os.O_RDONLY | os.O_NONBLOCK))
        except PermissionError:
            os._exit(1)
        os._exit(0)
    return os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 0


def fields():
    lines = [line for line in journal("-u", UNIT) if "POSED_CAUSE" in line]
    check(lines and all("POSED_COUNT" in line and "PRIORITY" in line for line in lines),
          f"{len(lines)} lines of the journal have POSED_CAUSE, POSED_COUNT and PRIORITY")
    of_glove = journal("-u", UNIT, "POSED_STREAM=glove")
    check(of_glove, f"{len(of_glove)} have POSED_STREAM=glove")


def disk_that_waits(viewer):
    """No write to the disk of the takes returns for 12 s, three times WatchdogSec."""
    viewer.flows()
    pid, log, since_s = main_pid(), newest_log(), time.time()
    run("fsfreeze", "--freeze", TAKES)
    end = time.monotonic() + 12
    longest_s = last = 0.0
    while time.monotonic() < end:
        begin = time.monotonic()
        last = viewer.flows(5)
        longest_s = max(longest_s, time.monotonic() - begin)
    run("fsfreeze", "--unfreeze", TAKES)
    check(main_pid() == pid and last and longest_s < 1,
          f"a disk that answers nothing for 12 s: posed goes on, longest time without a frame {longest_s:.2f} s")
    lines = [line["MESSAGE"] for line in journal("-u", UNIT, f"--since=@{since_s:.3f}")]
    check(sum("the thread posed-record waits for the disk" in line for line in lines) == 1,
          "the journal says once that the recorder waits for the disk")
    check(comes(lambda: any("the thread posed-record goes on" in line["MESSAGE"] for line in
                            journal("-u", UNIT, f"--since=@{since_s:.3f}")), 5), "and that it goes on")
    return log


def stop(log):
    begin = time.monotonic()
    run("systemctl", "stop", UNIT)
    took = time.monotonic() - begin
    check(shown("Result") == "success" and shown("ExecMainStatus") == "0" and took < 2,
          f"systemctl stop ends it with 0 after {took:.2f} s")
    left = glob.glob(f"{TAKES}/*-wal") + glob.glob(f"{TAKES}/*-journal")
    check(log + "-wal" not in left, "its log is closed")
    replay = run("posed", "replay", log, "--speed", "max", "--expect")
    if not check(replay.returncode == 0, "and replays bit for bit"):
        print(replay.stderr)


def failures():
    run("systemctl", "start", "posed@wrong")
    time.sleep(5)
    check(shown("ActiveState", "posed@wrong") == "failed" and shown("NRestarts", "posed@wrong") == "0"
          and shown("ExecMainStatus", "posed@wrong") == "2", "a wrong config is not tried again")
    begin = time.monotonic()
    run("systemctl", "start", "posed@hopeless")
    given_up = comes(lambda: shown("ActiveState", "posed@hopeless") == "failed", 120)
    check(given_up and shown("Result", "posed@hopeless") in ("start-limit-hit", "exit-code"),
          f"a config whose clip is missing is given up after {shown('NRestarts', 'posed@hopeless')} "
          f"new starts in {time.monotonic() - begin:.0f} s: {shown('Result', 'posed@hopeless')}")
    run("systemctl", "reset-failed")


def service():
    again = run("dpkg", "-i", *glob.glob("/opt/posed_*.deb"))
    check(again.returncode == 0, f"the package installs on a running machine{again.stderr}")
    pid = start()
    viewer = Viewer()
    check(viewer.flows(), "frames come")
    rights(pid)
    reload(pid)
    glove = device(pid)
    fields()
    each_thread_stopped(viewer)
    glove_that_hangs(viewer, glove)
    log = disk_that_waits(viewer)
    stop(log)
    failures()
    check(run("systemctl", "enable", UNIT).returncode == 0, "systemctl enable")


def reboot():
    check(comes(lambda: shown("ActiveState") == "active", 30), "posed begins with the machine")
    check(Viewer().flows(), "and gives frames without a network")
    check(shown("NRestarts") == "0", "at the first attempt")
    complaints = [line["MESSAGE"] for line in journal("-u", "systemd-udevd", "-b")
                  if "posed" in line["MESSAGE"]]
    check(not complaints, "udev has no complaint about the rules" + " ".join(complaints))
    units = ("posed@*", "modprobe@*", "systemd-udevd*", "var-lib-posed*")
    broken = run("systemctl", "--failed", "--plain", "--no-legend", "list-units", *units).stdout
    check(not broken, f"none of its units has failed{broken}")


def main():
    part = re.search(r"check=(\w+)", pathlib.Path("/proc/cmdline").read_text()).group(1)
    {"service": service, "reboot": reboot}[part]()
    if not failed:
        print("LAB PASSED " + part)
    sys.stdout.flush()
    run("systemctl", "poweroff")


main()

#!/usr/bin/env python3
"""Checks that includes only go to used rooms: rooms_test.py ROOMS, as cmake/Rooms.cmake writes it."""

import pathlib
import re
import sys
import unittest

ROOT = pathlib.Path(__file__).resolve().parent.parent
INCLUDE = re.compile(r'^\s*#include "([^"]+)"', re.MULTILINE)
# A host that builds the core itself gets only these.
PURE = ("protocol", "model", "emulator/core", "emulator/config")


def read_rooms(text: str) -> dict[str, set[str]]:
    """Returns the rooms, each with the rooms that it uses."""
    rooms: dict[str, set[str]] = {}
    for line in text.splitlines():
        room, uses = line.split(":")
        rooms[room] = set(uses.split())
    return rooms


def reachable(rooms: dict[str, set[str]], room: str) -> set[str]:
    """Returns the rooms that it uses directly or indirectly."""
    found: set[str] = set()
    waiting = list(rooms[room])
    while waiting:
        one = waiting.pop()
        if one not in found:
            found.add(one)
            waiting += rooms[one]
    return found


def room_of(rooms: dict[str, set[str]], path: str) -> str | None:
    return next((room for room in rooms if path.startswith(room + "/")), None)


class Rooms(unittest.TestCase):
    rooms: dict[str, set[str]] = {}

    def sources(self) -> list[pathlib.Path]:
        found = [p for top in ("protocol", "model", "emulator", "tools") for p in sorted((ROOT / top).rglob("*.[ch]pp"))]
        self.assertGreater(len(found), 200)
        return found

    def test_every_source_is_in_a_room(self) -> None:
        for path in self.sources():
            name = path.relative_to(ROOT).as_posix()
            if not name.startswith("tools/main/"):
                self.assertIsNotNone(room_of(self.rooms, name), f"{name}: in no room of CMakeLists.txt")

    def test_rooms_use_each_other_in_one_direction(self) -> None:
        for room in self.rooms:
            self.assertNotIn(room, reachable(self.rooms, room), "uses itself")

    def test_includes_go_only_to_used_rooms(self) -> None:
        for path in self.sources():
            name = path.relative_to(ROOT).as_posix()
            room = room_of(self.rooms, name)
            if room is None:
                continue
            allowed = reachable(self.rooms, room) | {room}
            for included in INCLUDE.findall(path.read_text("utf-8")):
                self.assertIn(room_of(self.rooms, included), allowed,
                              f"{name} includes {included}, which {room} does not use (CMakeLists.txt, lk_room)")

    def test_files_include_each_other_in_one_direction(self) -> None:
        includes = {p.relative_to(ROOT).as_posix(): INCLUDE.findall(p.read_text("utf-8")) for p in self.sources()}
        done: set[str] = set()

        def follow(name: str, way: list[str]) -> None:
            self.assertNotIn(name, way, "a circle")
            if name in done:
                return
            for included in includes.get(name, []):
                follow(included, [*way, name])
            done.add(name)

        for name in includes:
            follow(name, [])

    def test_pure_rooms_use_only_pure_rooms(self) -> None:
        for room in PURE:
            self.assertLessEqual(reachable(self.rooms, room), set(PURE), room)
        self.assertEqual(self.rooms["protocol"] | self.rooms["model"], set())


if __name__ == "__main__":
    Rooms.rooms = read_rooms(pathlib.Path(sys.argv.pop(1)).read_text("utf-8"))
    unittest.main()

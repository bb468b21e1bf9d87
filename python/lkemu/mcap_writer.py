"""Writes MCAP files, version 0 of https://mcap.dev/spec: JSON messages in indexed chunks without compression."""

from __future__ import annotations

import json
import struct
import tempfile
import zlib
from typing import BinaryIO, Dict, Iterable, List, NamedTuple, Tuple

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS = range(1, 12)
SUMMARY_OFFSET, DATA_END = 14, 15
CHUNK_BYTES = 1 << 20  # size of messages that closes a chunk
JSON_TYPES = ((bool, "boolean"), ((int, float), "number"), (str, "string"), (dict, "object"), (type(None), "null"))


def record(op: int, *fields: bytes) -> bytes:
    content = b"".join(fields)
    return struct.pack("<BQ", op, len(content)) + content


def sized(value: "str | bytes") -> bytes:
    """Prefixes a string or an array with its length."""
    data = value.encode() if isinstance(value, str) else value
    return struct.pack("<I", len(data)) + data


def table(code: str, rows: Iterable[Tuple[int, ...]]) -> bytes:
    return sized(b"".join(struct.pack(f"<{code}", *row) for row in rows))


def json_schema(value: object) -> Dict[str, object]:
    """JSON schema of a value; Foxglove needs the properties of messages."""
    if isinstance(value, dict):
        return {"type": "object", "properties": {key: json_schema(one) for key, one in value.items()}}
    if isinstance(value, list):
        return {"type": "array", "items": json_schema(value[0] if value else 0)}
    return {"type": next(name for kind, name in JSON_TYPES if isinstance(value, kind))}  # type: ignore[arg-type]


class Channel(NamedTuple):
    id: int
    topic: str
    schema: str


class Chunk(NamedTuple):
    start_ns: int
    end_ns: int
    offset: int  # from the start of the first chunk
    length: int
    size: int  # bytes of messages
    indexes: Dict[int, int]  # offset of the index of each channel, from the start of the first chunk
    index_length: int


class McapWriter:
    """Collects messages in a temporary file. `write` puts the schemas, which are complete at the end, before them."""

    def __init__(self, library: str) -> None:
        self._library = library
        self._schemas: Dict[str, Dict[str, object]] = {}  # properties by schema name
        self._channels: Dict[str, Channel] = {}
        self._attachments: List[Tuple[str, str, bytes]] = []
        self._counts: Dict[int, int] = {}
        self._body: BinaryIO = tempfile.TemporaryFile()  # type: ignore[assignment]
        self._chunks: List[Chunk] = []
        self._messages = bytearray()
        self._times: Dict[int, List[Tuple[int, int]]] = {}  # time and offset of the messages of this chunk, by channel

    def attach(self, name: str, media_type: str, data: bytes) -> None:
        self._attachments.append((name, media_type, data))

    def message(self, topic: str, schema: str, time_ns: int, value: Dict[str, object]) -> None:
        """Pre: all messages of a topic have one schema. Raises ValueError unless the time fits 64 unsigned bits."""
        if not isinstance(time_ns, int) or not 0 <= time_ns < 1 << 64:
            raise ValueError(f"time_ns: {time_ns}")
        channel = self._channels.setdefault(topic, Channel(len(self._channels) + 1, topic, schema))
        properties = self._schemas.setdefault(schema, {})
        for key in value.keys() - properties.keys():
            properties[key] = json_schema(value[key])
        sequence = self._counts.get(channel.id, 0)
        self._counts[channel.id] = sequence + 1
        self._times.setdefault(channel.id, []).append((time_ns, len(self._messages)))
        data = json.dumps(value, ensure_ascii=False, separators=(",", ":")).encode()
        self._messages += record(MESSAGE, struct.pack("<HIQQ", channel.id, sequence & 0xFFFFFFFF, time_ns, time_ns), data)
        if len(self._messages) >= CHUNK_BYTES:
            self._close_chunk()

    def write(self, file: BinaryIO) -> None:
        """Writes the whole file. Pre: called once, after all messages."""
        self._close_chunk()
        schemas, channels = self._definitions()
        head = MAGIC + record(HEADER, sized(""), sized(self._library))
        attachment_indexes = []
        for name, media_type, data in self._attachments:
            content = struct.pack("<QQ", 0, 0) + sized(name) + sized(media_type) + struct.pack("<Q", len(data)) + data
            packed = record(ATTACHMENT, content, struct.pack("<I", zlib.crc32(content)))
            index = struct.pack("<QQQQQ", len(head), len(packed), 0, 0, len(data)) + sized(name) + sized(media_type)
            attachment_indexes.append(record(ATTACHMENT_INDEX, index))
            head += packed
        head += b"".join(schemas + channels)
        file.write(head)
        self._body.seek(0)
        while piece := self._body.read(1 << 20):
            file.write(piece)
        data_end = record(DATA_END, struct.pack("<I", 0))  # 0: no checksum of all data; each chunk has one
        file.write(data_end)
        groups = [(SCHEMA, schemas), (CHANNEL, channels), (CHUNK_INDEX, [self._chunk_index(chunk, len(head)) for chunk in self._chunks]),
                  (ATTACHMENT_INDEX, attachment_indexes), (STATISTICS, [self._statistics()])]  # fmt: skip
        file.write(summary(groups, len(head) + self._body.tell() + len(data_end)))

    def _definitions(self) -> Tuple[List[bytes], List[bytes]]:
        """Records of the schemas and of the channels."""
        numbers = {name: number for number, name in enumerate(self._schemas, 1)}
        schemas = []
        for name, number in numbers.items():
            text = json.dumps({"type": "object", "properties": dict(sorted(self._schemas[name].items()))})
            schemas.append(record(SCHEMA, struct.pack("<H", number), sized(name), sized("jsonschema"), sized(text)))
        channels = [
            record(CHANNEL, struct.pack("<HH", channel.id, numbers[channel.schema]), sized(channel.topic), sized("json"), sized(b""))
            for channel in self._channels.values()
        ]
        return schemas, channels

    def _close_chunk(self) -> None:
        if not self._messages:
            return
        offset = self._body.tell()
        times = [time_ns for rows in self._times.values() for time_ns, _ in rows]
        start_ns, end_ns, size = min(times), max(times), len(self._messages)
        head = struct.pack("<QQQI", start_ns, end_ns, size, zlib.crc32(self._messages)) + sized("") + struct.pack("<Q", size)
        self._body.write(record(CHUNK, head, self._messages))
        length = self._body.tell() - offset
        indexes = {}
        for id, rows in self._times.items():
            indexes[id] = self._body.tell()
            self._body.write(record(MESSAGE_INDEX, struct.pack("<H", id), table("QQ", rows)))
        self._chunks.append(Chunk(start_ns, end_ns, offset, length, size, indexes, self._body.tell() - offset - length))
        self._messages.clear()
        self._times.clear()

    @staticmethod
    def _chunk_index(chunk: Chunk, begin: int) -> bytes:
        """Index record of a chunk; `begin` is the offset of the first chunk in the file."""
        indexes = table("HQ", ((id, begin + offset) for id, offset in chunk.indexes.items()))
        return record(CHUNK_INDEX, struct.pack("<QQQQ", chunk.start_ns, chunk.end_ns, begin + chunk.offset, chunk.length), indexes,
                      struct.pack("<Q", chunk.index_length), sized(""), struct.pack("<QQ", chunk.size, chunk.size))  # fmt: skip

    def _statistics(self) -> bytes:
        start_ns = min((chunk.start_ns for chunk in self._chunks), default=0)
        end_ns = max((chunk.end_ns for chunk in self._chunks), default=0)
        counts = (sum(self._counts.values()), len(self._schemas), len(self._channels), len(self._attachments), 0, len(self._chunks))
        return record(STATISTICS, struct.pack("<QHIIIIQQ", *counts, start_ns, end_ns), table("HQ", self._counts.items()))


def summary(groups: List[Tuple[int, List[bytes]]], begin: int) -> bytes:
    """Bytes after the data: the summary, which begins at offset `begin`, footer and magic."""
    data, offsets = b"", b""
    for op, records in groups:
        joined = b"".join(records)
        if joined:
            offsets += record(SUMMARY_OFFSET, struct.pack("<BQQ", op, begin + len(data), len(joined)))
            data += joined
    footer = struct.pack("<BQQQ", FOOTER, 20, begin, begin + len(data))
    covered = data + offsets + footer
    return covered + struct.pack("<I", zlib.crc32(covered)) + MAGIC

"""Reads MCAP files as specified by https://mcap.dev/spec, independent of the writer of lk-emu.

Asserts checksums, indexes, counts and the summary."""

import struct
import zlib

MAGIC = b"\x89MCAP0\r\n"
HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK, MESSAGE_INDEX, CHUNK_INDEX, ATTACHMENT, ATTACHMENT_INDEX, STATISTICS = range(1, 12)
SUMMARY_OFFSET, DATA_END = 14, 15


class Fields:
    def __init__(self, data):
        self.data, self.at = data, 0

    def take(self, count):
        assert self.at + count <= len(self.data), "a field goes beyond its record"
        self.at += count
        return self.data[self.at - count:self.at]

    def number(self, code):
        return struct.unpack("<" + code, self.take(struct.calcsize("<" + code)))[0]

    def text(self):
        return self.take(self.number("I")).decode()

    def table(self, *codes):
        """Reads an array or a map of numbers."""
        rows = Fields(self.take(self.number("I")))
        found = []
        while rows.at < len(rows.data):
            found.append(tuple(rows.number(code) for code in codes))
        return found

    def rest(self):
        return self.take(len(self.data) - self.at)


def records(data, at=0):
    """Yields (offset, op code, content) of whole records; omits a truncated one."""
    while at + 9 <= len(data):
        op, length = data[at], struct.unpack_from("<Q", data, at + 1)[0]
        if at + 9 + length > len(data):
            return
        yield at, op, data[at + 9:at + 9 + length]
        at += 9 + length


class Mcap:
    """Contents of a file.

    `schemas`: {id: (name, encoding, text)}.
    `channels`: {id: (schema, topic, encoding)}.
    `attachments`: {name: bytes}.
    `messages`: [(channel, sequence, log_time_ns, bytes)] in the order of the file.
    `complete`: the file was closed."""

    def __init__(self, data):
        self.data = data
        self.schemas, self.channels, self.attachments, self.messages = {}, {}, {}, []
        self.chunks, self.loose = [], 0  # loose: messages outside of chunks
        self.complete = False
        assert data[:8] == MAGIC
        self.read_data()
        if self.complete:
            self.check_summary()

    def read_data(self):
        for offset, op, content in records(self.data, 8):
            if offset == 8:
                assert op == HEADER
                self.library = self.header(content)
            elif op == DATA_END:
                self.complete = True
                self.data_end = offset
                return
            else:
                self.take(offset, op, content)

    @staticmethod
    def header(content):
        fields = Fields(content)
        fields.text()
        return fields.text()

    def take(self, offset, op, content, chunk=None):
        fields = Fields(content)
        if op == SCHEMA:
            number = fields.number("H")
            self.schemas[number] = (fields.text(), fields.text(), fields.text())
        elif op == CHANNEL:
            number, schema = fields.number("H"), fields.number("H")
            assert schema in self.schemas
            self.channels[number] = (schema, fields.text(), fields.text())
        elif op == MESSAGE:
            channel, sequence, log_time, _ = (fields.number(code) for code in "HIQQ")
            assert channel in self.channels
            self.messages.append((channel, sequence, log_time, fields.rest()))
            if chunk is None:
                self.loose += 1
            else:
                chunk["messages"].append((channel, log_time, offset))
        elif op == ATTACHMENT:
            fields.number("Q"), fields.number("Q")
            name, _ = fields.text(), fields.text()
            self.attachments[name] = fields.take(fields.number("Q"))
            assert fields.number("I") == zlib.crc32(content[:-4])
        elif op == CHUNK:
            self.take_chunk(offset, fields, len(content) + 9)
        elif op == MESSAGE_INDEX:
            chunk = self.chunks[-1]
            channel = fields.number("H")
            chunk["indexes"][channel] = offset
            wanted = [(log_time, at) for number, log_time, at in chunk["messages"] if number == channel]
            assert fields.table("Q", "Q") == wanted and wanted
        else:
            raise AssertionError(f"op code {op} among the data")

    def take_chunk(self, offset, fields, length):
        start, end, size, crc = (fields.number(code) for code in "QQQI")
        assert fields.text() == ""
        assert fields.number("Q") == size
        inside = fields.rest()
        assert len(inside) == size and zlib.crc32(inside) == crc
        chunk = {"offset": offset, "length": length, "start": start, "end": end, "size": size, "messages": [], "indexes": {}}
        self.chunks.append(chunk)
        for at, op, content in records(inside):
            self.take(at, op, content, chunk)
        times = [log_time for _, log_time, _ in chunk["messages"]]
        assert (start, end) == ((min(times), max(times)) if times else (start, start))

    def check_summary(self):
        data = self.data
        assert data[-8:] == MAGIC
        footer = len(data) - 8 - 29
        assert data[footer] == FOOTER
        summary, offsets, crc = struct.unpack("<QQI", data[footer + 9:-8])
        assert zlib.crc32(data[summary:footer + 25]) == crc
        groups, found = {}, {}
        for at, op, content in records(data[:offsets], summary):
            groups.setdefault(op, []).append((at, len(content) + 9))
            found.setdefault(op, []).append(content)
        group_offsets = [struct.unpack("<BQQ", content)
                for _, op, content in records(data[:footer], offsets) if op == SUMMARY_OFFSET]
        assert group_offsets == [(op, rows[0][0], sum(length for _, length in rows)) for op, rows in groups.items()]
        in_data = [data[at:at + 9 + len(content)] for at, op, content in records(data[:self.data_end], 8) if op in (SCHEMA, CHANNEL)]
        for op in (SCHEMA, CHANNEL):
            for at, length in groups.get(op, []):
                assert data[at:at + length] in in_data
        self.check_chunk_indexes(found.get(CHUNK_INDEX, []))
        self.check_attachment_indexes(found.get(ATTACHMENT_INDEX, []))
        self.check_statistics(found[STATISTICS])

    def check_chunk_indexes(self, found):
        assert len(found) == len(self.chunks) and self.loose == 0
        for content, chunk in zip(found, self.chunks):
            fields = Fields(content)
            assert [fields.number("Q") for _ in range(4)] == [chunk["start"], chunk["end"], chunk["offset"], chunk["length"]]
            assert dict(fields.table("H", "Q")) == chunk["indexes"]
            assert set(chunk["indexes"]) == {channel for channel, _, _ in chunk["messages"]}
            length = fields.number("Q")
            ends = [at + 9 + len(content) for at, op, content in records(self.data, chunk["offset"] + chunk["length"]) if at in chunk["indexes"].values()]
            assert ends[-1] - chunk["offset"] - chunk["length"] == length
            assert fields.text() == "" and fields.number("Q") == fields.number("Q") == chunk["size"]

    def check_attachment_indexes(self, found):
        assert len(found) == len(self.attachments)
        for content in found:
            fields = Fields(content)
            offset, length, _, _, size = (fields.number("Q") for _ in range(5))
            assert self.data[offset] == ATTACHMENT and struct.unpack_from("<Q", self.data, offset + 1)[0] == length - 9
            assert len(self.attachments[fields.text()]) == size

    def check_statistics(self, found):
        fields = Fields(found[0])
        assert len(found) == 1
        counts = [fields.number(code) for code in "QHIIII"]
        assert counts == [len(self.messages), len(self.schemas), len(self.channels), len(self.attachments), 0, len(self.chunks)]
        times = [log_time for _, _, log_time, _ in self.messages] or [0]
        assert [fields.number("Q"), fields.number("Q")] == [min(times), max(times)]
        per_channel = {}
        for channel, sequence, _, _ in self.messages:
            assert sequence == per_channel.get(channel, 0)
            per_channel[channel] = sequence + 1
        assert dict(fields.table("H", "Q")) == per_channel

    def of(self, topic):
        """Messages of a topic as [(log_time_ns, bytes)]."""
        return [(log_time, data) for channel, _, log_time, data in self.messages if self.channels[channel][1] == topic]

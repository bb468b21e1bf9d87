-- Wireshark dissector for LK-TECH motors on CAN. lk-emu-formats of lk-emu generates it from the
-- tables of commands; docs/reference/formats.md describes its use. Frames do not show generation
-- and series. These come from the capture if lk-emu has written it (run and replay, --capture),
-- else from the preferences (Protocols > LK.MOTOR).

-- @tables

local proto = Proto("lk.motor", "LK-TECH motor")
local QUERY, REPLY = 0, 1
local ECHO_OR_NOT, SURELY = 1, 2
local LONGEST_REPLY_S = 0.1 -- assumed, as in all of lk-emu; drives answer within 1 ms
local SINGLE_ID, DRIVES = 0x140, 32

-- Wireshark fields, one for each name.

local meta = {
  drive = ProtoField.uint8("lk.motor.drive", "Drive"),
  kind = ProtoField.uint8("lk.motor.kind", "Kind", base.DEC, { [QUERY] = "query", [REPLY] = "reply" }),
  command = ProtoField.uint8("lk.motor.command", "Command", base.HEX),
  command_name = ProtoField.string("lk.motor.command_name", "Command name"),
  reply_in = ProtoField.framenum("lk.motor.reply_in", "Reply in frame", base.NONE, frametype.RESPONSE),
  reply_to = ProtoField.framenum("lk.motor.reply_to", "Reply to frame", base.NONE, frametype.REQUEST),
  response_time = ProtoField.relative_time("lk.motor.response_time", "Response time"),
}

local function proto_field(name, about)
  local filter = "lk.motor." .. name
  if about.kind == "flag" then return ProtoField.bool(filter, about.label) end
  if about.kind == "double" then return ProtoField.double(filter, about.label) end
  if about.kind == "int" then return ProtoField.int32(filter, about.label, base.DEC, about.values) end
  return ProtoField.uint32(filter, about.label, base.DEC, about.values)
end

local all_fields = {}
for _, field in pairs(meta) do all_fields[#all_fields + 1] = field end
for name, about in pairs(names) do
  about.field = proto_field(name, about)
  all_fields[#all_fields + 1] = about.field
end
proto.fields = all_fields

local experts = {
  unanswered = ProtoExpert.new("lk.motor.unanswered", "No reply in this capture",
    expert.group.SEQUENCE, expert.severity.WARN),
  orphan = ProtoExpert.new("lk.motor.orphan", "A reply, but to no query of this capture",
    expert.group.SEQUENCE, expert.severity.NOTE),
  errors = ProtoExpert.new("lk.motor.errors", "The drive reports an error",
    expert.group.RESPONSE_CODE, expert.severity.ERROR),
  unknown = ProtoExpert.new("lk.motor.unknown_command", "No command of this generation and series: no drive answers",
    expert.group.PROTOCOL, expert.severity.WARN),
  length = ProtoExpert.new("lk.motor.wrong_length", "Not 8 bytes: no drive answers",
    expert.group.MALFORMED, expert.severity.WARN),
}
proto.experts = { experts.unanswered, experts.orphan, experts.errors, experts.unknown, experts.length }

proto.prefs.generation = Pref.enum("Generation", 0, "Firmware of the drives",
  generations, false)
proto.prefs.series = Pref.enum("Series", 0, "Series of the drives: how much one LSB of a current is",
  { { 1, "MF, MH", 0 }, { 2, "MG", 1 }, { 3, "MS", 2 } }, false)
proto.prefs.reply_base = Pref.enum("Identifier of replies", SINGLE_ID, "Where drives answer",
  { { 1, "0x140 + ID", SINGLE_ID }, { 2, "0x180 + ID", 0x180 }, { 3, "0x240 + ID", 0x240 } }, false)

-- Returns a field of another dissector. If this version of Wireshark does not have the field,
-- returns a function that returns nil.
local function field_if_known(name)
  local known, field = pcall(Field.new, name)
  return known and field or function() return nil end
end

local frame_description = field_if_known("frame.interface_description")

-- Returns the formats of the drives of a bus, by ID. `text` is the description that lk-emu gives
-- the interface: "LK-TECH drives: 1 v235 MG, 2 legacy MF".
local described = {}
local function drives_described(text)
  if described[text] then return described[text] end
  local found = {}
  if text:find("^LK%-TECH drives: ") then
    for id, name, series in text:gmatch("(%d+) ([%w-]+) (M%u)") do
      for _, generation in ipairs(generations) do
        if generation[2] == name then
          found[tonumber(id)] = formats[generation[3] + 1][series == "MG" and 2 or series == "MS" and 3 or 1]
        end
      end
    end
  end
  described[text] = found
  return found
end

-- Returns the format of the drive `id`; without an ID, that of the first of the drives 1 to 4,
-- which multi-drive commands address.
local function format(id)
  local description = frame_description()
  if description then
    local found = drives_described(tostring(description.value))
    for n = id or 1, id or 4 do
      if found[n] then return found[n] end
    end
  end
  return formats[proto.prefs.generation + 1][proto.prefs.series + 1]
end

-- Reading and formatting numbers of a frame.

local function byte(tvb, n) return tvb(n, 1):uint() end

-- Reads the number of a field. Starts with the highest byte, so that a 56-bit number is exact if a
-- double can hold it.
local function raw_value(tvb, first_bit, bits, is_signed)
  local first = math.floor(first_bit / 8)
  if bits < 8 then return math.floor(byte(tvb, first) / 2 ^ (first_bit % 8)) % 2 ^ bits end
  local last = first + bits / 8 - 1
  local value = byte(tvb, last)
  if is_signed and value >= 128 then value = value - 256 end
  for n = last - 1, first, -1 do value = value * 256 + byte(tvb, n) end
  return value
end

-- Returns raw * lsb, rounded to 15 digits: 0.57 and not 0.57000000000000006.
local function scaled(raw, lsb)
  if lsb == 1 then return raw end
  return tonumber(string.format("%.15g", raw * lsb))
end

-- Returns the unit with a space before it; no space before "°" and units that begin with it, except
-- "°C".
local function unit_text(about)
  if about.unit == "" then return "" end
  local apart = about.unit == "°C" or about.unit:sub(1, #"°") ~= "°"
  return (apart and " " or "") .. about.unit
end

local function words(about, value)
  if about.values and about.values[value] then return about.values[value] end
  if about.unit == "A" then value = tonumber(string.format("%.3f", value)) end
  return string.format("%.15g", value) .. unit_text(about)
end

-- Telling queries from replies. Both have the same identifier, so the order of frames decides, by
-- the rules of docs/reference/formats.md: a frame is a reply if it fits a pending query to its
-- drive.

local state -- of the capture: kinds and pairs of the frames so far

local function new_state() state = { frames = {}, drives = {}, several = {} } end
new_state()
function proto.init() new_state() end

local function drive_state(bus, id)
  local key = bus .. ":" .. id
  state.drives[key] = state.drives[key] or { pending = {}, seen_several = 0, run = nil }
  return state.drives[key]
end

local function same(a, b)
  for n = 1, 8 do
    if a[n] ~= b[n] then return false end
  end
  return true
end

local function is_state(command) return (command >= 0x9A and command <= 0x9D) or (command >= 0xA0 and command <= 0xA8) end

-- Returns SURELY if a frame with `data` must be a reply to the query, ECHO_OR_NOT if it may be the
-- reply or the query repeated, nil if it cannot be the reply.
local function fit(asked, data, surely_a_reply)
  if asked.command ~= data[1] then return nil end
  -- A reply repeats the bytes that select its parameter or setting. Settings with 0x05 have a
  -- second such byte, gains do not.
  local repeats = asked.several and 0 or commands[data[1]].repeats
  if repeats > 0 and asked.data[2] ~= data[2] then return nil end
  if repeats > 1 and data[2] == 0x05 and asked.data[3] ~= data[3] then return nil end
  if surely_a_reply then return SURELY end
  local equal = same(asked.data, data)
  if commands[data[1]].echo then return equal and ECHO_OR_NOT or nil end
  -- DATA[1] is a temperature in a state, but 0 or a direction (0, 1) in a query.
  if is_state(data[1]) then return not equal and data[2] > 1 and SURELY or nil end
  return (equal or commands[data[1]].alike) and ECHO_OR_NOT or SURELY
end

-- Returns the DATA[0] with which the drive `id` replies to a multi-drive query; nil if it does not.
local function command_for(query, id)
  local own = { [0x280] = 0xA1, [0x281] = 0xA2, [0x282] = 0xA3 }
  if own[query.id] then return own[query.id] end
  local command = id <= 4 and query.data[2 * id - 1] or 0
  return commands[command] and command or nil
end

-- Adds the multi-drive queries since the last frame of this drive to the drive's pending queries.
local function take_several(drive, bus, id, now)
  for n = drive.seen_several + 1, #state.several do
    local query = state.several[n]
    local command = query.bus == bus and command_for(query, id)
    if query.bus == bus then drive.run = nil end
    if command and now - query.time <= LONGEST_REPLY_S then
      drive.pending[#drive.pending + 1] =
        { frame = query.frame, time = query.time, command = command, data = query.data, several = true }
    end
  end
  drive.seen_several = #state.several
end

local function drop_old(drive, now)
  while drive.pending[1] and now - drive.pending[1].time > LONGEST_REPLY_S do table.remove(drive.pending, 1) end
end

local function unlink(asked, reply)
  local replies = state.frames[asked.frame].replies
  for n = #replies, 1, -1 do
    if replies[n] == reply then table.remove(replies, n) end
  end
end

local function link(asked, reply, time)
  local record = state.frames[reply]
  if record.asked then unlink(record.asked, reply) end
  record.kind, record.asked, record.delay = REPLY, asked, time - asked.time
  local replies = state.frames[asked.frame].replies
  replies[#replies + 1] = reply
end

-- If a frame fits several pending queries, the earliest of them got no reply: n replies in a row
-- belong to the last n queries. So each further reply of such a run moves the replies before it to
-- an earlier query. Returns false if the frame does not continue a run.
local function continue_run(drive, frame, time, data, sure)
  local run = drive.run
  if not run or #run.replies == #run.asked then return false end
  local last = run.asked[#run.asked]
  if time - last.time > LONGEST_REPLY_S or fit(last, data, sure) ~= SURELY then return false end
  run.replies[#run.replies + 1] = { frame = frame, time = time }
  for n, reply in ipairs(run.replies) do
    link(run.asked[#run.asked - #run.replies + n], reply.frame, reply.time)
  end
  return true
end

local function start_run(drive, frame, time, data, sure)
  local asked, last = {}, 0
  for n, query in ipairs(drive.pending) do
    if fit(query, data, sure) then
      asked[#asked + 1] = query
      last = n
    end
  end
  if last == 0 then return false end
  for _ = 1, last do table.remove(drive.pending, 1) end
  drive.run = { asked = asked, replies = { { frame = frame, time = time } } }
  link(asked[#asked], frame, time)
  return true
end

-- Classifies a single-drive frame when Wireshark reads it for the first time. `answers`: QUERY or
-- REPLY if the identifier shows it, else nil.
local function learn_single(bus, id, frame, time, data, answers)
  local drive = drive_state(bus, id)
  local record = { kind = QUERY, replies = {}, expects = false }
  state.frames[frame] = record
  if not commands[data[1]] then
    drive.run = nil
    return
  end
  take_several(drive, bus, id, time)
  drop_old(drive, time)
  local may_reply, may_ask = answers ~= QUERY, answers ~= REPLY
  local sure = answers == REPLY
  if may_reply and (continue_run(drive, frame, time, data, sure) or start_run(drive, frame, time, data, sure)) then return end
  drive.run = nil
  if not may_ask or (may_reply and is_state(data[1]) and data[2] > 1) then
    record.kind, record.orphan = REPLY, true
    return
  end
  record.expects = format(id).queries[data[1]] ~= nil and commands[data[1]].answered
  if record.expects then
    drive.pending[#drive.pending + 1] = { frame = frame, time = time, command = data[1], data = data }
  end
end

local function learn_several(bus, id, frame, time, data)
  state.frames[frame] = { kind = QUERY, replies = {}, expects = format().several[id] ~= nil }
  state.several[#state.several + 1] = { bus = bus, id = id, frame = frame, time = time, data = data }
end

-- Display of frames.

local function add_fields(tree, tvb, layout)
  local said, errors, selected = {}, {}, {}
  for _, one in ipairs(layout) do
    local name, first_bit, bits, is_signed, lsb, selector, only_at = one[1], one[2], one[3], one[4], one[5], one[6], one[7]
    if not selector or selected[selector] == only_at then
      local about = names[name]
      selected[name] = raw_value(tvb, first_bit, bits, is_signed)
      local value = scaled(selected[name], lsb)
      local range = tvb(math.floor(first_bit / 8), math.ceil(bits / 8))
      if about.kind == "flag" then
        tree:add(about.field, range, value ~= 0)
        if value ~= 0 then errors[#errors + 1] = about.label end
      else
        local item = tree:add(about.field, range, value)
        item:append_text(unit_text(about))
        said[#said + 1] = about.label .. " " .. words(about, value)
      end
    end
  end
  if #errors > 0 then
    local text = table.concat(errors, ", ")
    tree:add_proto_expert_info(experts.errors, text)
    said[#said + 1] = "ERROR: " .. text
  end
  return table.concat(said, ", ")
end

local function add_pairing(tree, record)
  if record.asked then
    tree:add(meta.reply_to, record.asked.frame):set_generated()
    local s = math.floor(record.delay)
    tree:add(meta.response_time, NSTime.new(s, math.floor((record.delay - s) * 1e9 + 0.5))):set_generated()
  elseif record.orphan then
    tree:add_proto_expert_info(experts.orphan)
  end
  for _, reply in ipairs(record.replies) do tree:add(meta.reply_in, reply):set_generated() end
  -- While Wireshark reads a capture for the first time, a reply may still follow.
  if record.kind == QUERY and record.expects and #record.replies == 0 and record.complete then
    tree:add_proto_expert_info(experts.unanswered)
  end
end

local function show(tvb, pinfo, tree, title, name, layout, record)
  tree:add(meta.kind, record.kind):set_generated()
  tree:add(meta.command_name, name):set_generated()
  if not layout then
    tree:add_proto_expert_info(experts.unknown)
    pinfo.cols.info = title .. name
    return
  end
  local said = add_fields(tree, tvb, layout)
  add_pairing(tree, record)
  pinfo.cols.info = title .. name .. (said ~= "" and ": " .. said or "")
end

local frame_interface = field_if_known("frame.interface_id")
local remote_request = field_if_known("can.flags.rtr")
local can_fd_flag = field_if_known("canfd.flags.brs") -- only CAN FD frames have it

local function dissect_single(tvb, pinfo, tree, id, base_id, record)
  local command = byte(tvb, 0)
  local item = tree:add(meta.command, tvb(0, 1))
  local known = commands[command]
  if known then item:append_text(" (" .. known.name .. ")") end
  local drive = id - base_id
  tree:add(meta.drive, drive):set_generated()
  local reply = record.kind == REPLY
  local layouts_now = reply and format(drive).replies or format(drive).queries
  show(tvb, pinfo, tree, "Drive " .. drive .. (reply and " → " or " ← "),
    known and known.name or string.format("unknown command 0x%02X", command), layouts_now[command], record)
end

function proto.dissector(tvb, pinfo, root)
  local remote = remote_request()
  if (remote and remote.value) or can_fd_flag() then return 0 end -- drives ignore both
  local id = pinfo.match_uint
  pinfo.cols.protocol = "LK"
  local tree = root:add(proto, tvb())
  if tvb:len() ~= 8 then
    tree:add_proto_expert_info(experts.length)
    pinfo.cols.info = string.format("0x%03X: %d bytes", id, tvb:len())
    return tvb:len()
  end
  local reply_base = proto.prefs.reply_base
  local from_drive = reply_base ~= SINGLE_ID and id > reply_base and id <= reply_base + DRIVES
  local base_id = from_drive and reply_base or SINGLE_ID
  if not pinfo.visited or not state.frames[pinfo.number] then
    local interface = frame_interface()
    local bus = interface and tostring(interface.value) or "0"
    local data = {}
    for n = 1, 8 do data[n] = byte(tvb, n - 1) end
    if several[id] then
      learn_several(bus, id, pinfo.number, pinfo.rel_ts, data)
    else
      local answers = reply_base ~= SINGLE_ID and (from_drive and REPLY or QUERY) or nil
      learn_single(bus, id - base_id, pinfo.number, pinfo.rel_ts, data, answers)
    end
  end
  local record = state.frames[pinfo.number]
  record.complete = pinfo.visited
  if several[id] then
    show(tvb, pinfo, tree, "Drives 1–4 ← ", several[id].name, format().several[id], record)
  else
    dissect_single(tvb, pinfo, tree, id, base_id, record)
  end
  return 8
end

local can_ids = DissectorTable.get("can.id")
local function register(first, last)
  for id = first, last do can_ids:add(id, proto) end
end
register(SINGLE_ID + 1, SINGLE_ID + DRIVES)
for id in pairs(several) do register(id, id) end

local replies_at = SINGLE_ID
function proto.prefs_changed()
  if replies_at == proto.prefs.reply_base then return end
  if replies_at ~= SINGLE_ID then
    for id = replies_at + 1, replies_at + DRIVES do can_ids:remove(id, proto) end
  end
  replies_at = proto.prefs.reply_base
  if replies_at ~= SINGLE_ID then register(replies_at + 1, replies_at + DRIVES) end
end

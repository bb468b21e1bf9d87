// All words of the page in English; words_zh.js translates them, and what it lacks is shown in English.

export const kEnglish = {
  // the frame
  to_content: 'To the content', views: 'Views', bus: 'Bus', scope: 'Scope', traffic: 'Traffic', bench: 'Bench',
  simulated: 'simulated', clock: 'clock', of_real_time: 'of real time', slipped: 'slipped', theme: 'Dark or light',
  other_language: '中文', other_language_label: '中文（切换语言）',
  token: 'Token', token_why: 'This lk-emu can be reached from other machines and requires its token.', enter: 'Enter',
  read_only: 'read-only', may_act_with: 'start lk-emu with --http-write to allow changes',
  lost: 'No answer from lk-emu: what is shown is old. Trying again every second.',
  load_of: 'load of {bus}', bus_rate: '{bus}, {rate} kbit/s', bus_no_time: '{bus}: frames take no time', down: 'down',
  drive: 'Drive {name}', drives: 'drives', all: 'all', none: 'none', set: 'Set', clear: 'Clear', resume: 'Resume', pause: 'Pause',
  // clock modes
  realtime: 'realtime', stepped: 'stepped',

  // the bus
  angle: 'angle', angle_about: 'multi-turn angle as the drive reports it, of the rotor', shaft_about: 'where the output shaft truly stands',
  speed: 'speed', current: 'iq', power_share: 'power', voltage: 'bus', motor: 'motor', stage: 'stage', replies: 'replies',
  speed_about: 'speed as the drive reports it, of the rotor', current_about: 'torque current, measured', voltage_about: 'voltage, measured',
  motor_about: 'temperature of the motor, measured', stage_about: 'temperature of the power stage, measured',
  replies_about: 'frames that have left the drive, per second of simulated time',
  per_second: '/s', no_power: 'no power', no_errors: 'no errors', running: 'running', stopped: 'stopped', off: 'off',
  scope_link: 'scope', bench_link: 'bench', traffic_link: 'traffic',
  scope_of: 'Scope of drive {name}', bench_of: 'Bench of drive {name}', traffic_of: 'Traffic of drive {name}',
  shaft_at: '{label}, shaft at {angle}',
  summary: '{drives} drives: {running} running, {errors} with errors, {dead} without power; {replies} replies/s',
  bus_summary: '{drives} drives, {replies} replies/s', faults_here: 'injected: {names}', fault_in_state: '{name} ({state})',

  // advice
  advice: 'Advice', advice_about: 'Mistakes of hosts that real drives would not tolerate', advice_none: 'No advice so far.',
  advice_times: '{n} times, first at {time} s', advice_frame: 'go to the frame', advice_todo: 'What to do:',

  // the scope
  width: 'view', width_label: 'seconds in view', rate: 'sampled at', rate_label: 'samples per second', zoom_in: 'zoom in', zoom_out: 'zoom out', earlier: 'earlier', later: 'later',
  cursor_label: 'set cursor {name}', no_cursors: 'clear cursors', no_cursors_about: 'remove both cursors', csv_about: 'save what is in view',
  signal_sets: 'sets of signals', signals: 'signals', all_signals: 'all signals', all_drives: 'all drives', all_drives_about: 'all drives; again: those chosen before', drive_label: 'drive {name}',
  group_position: 'position', group_speed: 'speed', group_current: 'current', group_phases: 'phases', group_duties: 'duties',
  group_temperatures: 'temperatures', group_supply: 'supply',
  scope_info: '{frames} fps, {kept} s kept', scope_lost: ', {n} samples lost', scope_reduced: ', limited to {rate} Hz',
  scope_refused: ', no samples of {bus}: lk-emu refuses the stream; other pages may use all of its capacity', no_such_drive: 'there is no drive {name}',
  plots_label: 'Plots. Space pauses, plus and minus zoom, arrows move, a and b set cursors, Escape removes them.',
  plot_of: 'Signals in {unit}: {traces}', trace: 'trace', now: 'now', least: 'min', most: 'max',
  between: 'B − A = {ms} ms, {hz} Hz. Min and max between the cursors.',
  in_view: '{s} s. Min and max in view.', in_view_held: 'Paused: a click sets cursor A, the next one B. Min and max in view.',
  csv_saved: '{rows} samples from {from} s to {to} s saved', csv_nothing: 'there is nothing to save',
  not_watched: 'the scope was not sampling this drive then', mark_frame: 'frame',
  unit_duty: 'duty', unit_counts: 'counts', unit_power: 'share of voltage', unit_state: 'state',

  // the traffic
  show: 'show', both_ways: 'both directions', queries: 'queries', replies_only: 'replies', commands: 'commands', with_text: 'with', any_text: 'any text',
  marked_only: 'errors and advice only', frames_label: 'frames', frames_scroller: 'frames, oldest first',
  head_time: 'time, s', head_gap: 'gap, ms', head_way: 'dir', head_command: 'cmd', head_name: 'name', head_says: 'values', head_frame: 'frame',
  to_all: 'all', instant_in_scope: 'show {time} s in the scope',
  frames_info: '{shown} of {all} frames', frames_lost: ', {n} not received',
  frame_gone: 'The frame at {time} s is not here: it is too old, or from before this view was opened.',

  // the bench
  page_read_only: 'This page is read-only. Start lk-emu with --http-write to allow changes.',
  for_drives: 'for drives', drives_meant: 'selected drives', choose_first: 'choose a drive first', needs_number: '{name}: enter a number within its range',
  shaft: 'Shaft', clock_title: 'Clock', supply_and_ambient: 'Supply and ambient', load: 'Load', inject_fault: 'Inject a fault', scenario: 'Scenario', evidence: 'Faults and their evidence',
  shaft_by_hand: 'Shaft, turned by hand', turn_hint: 'Turn the shaft by hand: drag, or arrow keys', drag_hint: 'Drag the dial, or arrow keys.',
  no_drive: 'no drive', no_drive_chosen: 'No drive is chosen.', shaft_angle: 'shaft', target_angle: 'target', supply_current: 'from supply', page_only_looks: 'this page is read-only',
  power: 'power', power_on: 'Power on', power_off: 'Power off', cycle: 'Cycle', off_for: 'off for', off_for_label: 'off for, s',
  power_is_on: 'power is on', power_is_off: 'power is off', power_cycled: 'off for {s} s, then on',
  supply: 'supply', supply_label: 'supply, V', within: 'within', within_label: 'within, s', set_supply: 'set the supply', supply_goes: 'supply goes to {V} V',
  sag_to: 'sag to', sag_to_label: 'sag to, V', sag_for: 'for', sag_for_label: 'for, s', sag: 'Sag', sag_done: 'sag to {V} V',
  ambient: 'ambient', ambient_label: 'ambient, °C', set_ambient: 'set the ambient temperature', ambient_is: 'ambient temperature: {C} °C',
  now_supplied: 'Drive {name} now: {power}, {V} V, ambient {C} °C.', now_on: 'power on', now_off: 'power off',
  inertia: 'inertia', inertia_about: 'at the output', torque: 'torque', torque_about: 'constant, positive pushes clockwise',
  gravity: 'gravity', gravity_about: 'm·g·l of an arm: the torque is −gravity·sin(angle)', stop_from: 'stop from', stop_to: 'to', stop_about: 'end stop, output; empty: none',
  set_load: 'Set load', as_now: 'As it is now', load_is: 'load set', load_now: 'Drive {name} now: {text}',
  clock_is: 'the clock is {mode}', time_is: 'time: {s} s', real_time: 'Real time', stop_clock: 'Stop the clock', time_stands: 'time is stopped', scale: 'Scale', step: 'Step', by: 'by',
  end: 'End', end_about: 'stop the advance in progress',
  clock_says: '{time} of simulated time, {mode}', clock_advancing: ', advancing', clock_slipped: '; {s} s slipped: the machine was too busy',
  fault: 'fault', inject: 'Inject', of_whole_bus: '(of the whole bus)', needed: 'required', until_cleared: 'until cleared', once: 'once', no_end: 'no end',
  from_to: '{min} to {max}', fault_injected: '{names} injected', fault_cleared: '{name} cleared', clear_fault: 'clear {name}', clear_all: 'Clear all', all_cleared: 'all faults cleared',
  fault_name: 'name', fault_state: 'state', fault_of: 'of', fault_parameters: 'parameters', fault_began: 'began', fault_first: 'first effect', fault_effects: 'effects',
  fault_first_on: 'first on', nothing_yet: 'nothing yet', no_faults: 'No faults so far.',
  start_scenario: 'Start scenario', stop_scenario: 'Stop scenario', choose_one: 'choose one', shipped: 'shipped', or_file: 'or a file', has_begun: '{name} started', ended: 'ended',
  scenario_at: '{name}, {time} of {all} s', took_effect: 'took effect',
  other_robot: 'Written for another robot, {robot}: {drives}. What it expects need not hold for these drives.',
  other_motor: 'drive {name} is {meant} there, {running} here', no_such_motor: 'drive {name} is {meant} there, none here', and_more: '{n} more', no_effect: 'no effect',
};

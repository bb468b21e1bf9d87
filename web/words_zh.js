// 页面上的全部中文；没有译的显示英文，用词见 docs/zh-CN/terms.md。

export const kChinese = {
  // 页面框架
  to_content: '跳到正文', views: '视图', bus: '总线', scope: '示波器', traffic: '报文', bench: '试验台',
  simulated: '仿真时间', clock: '时钟', of_real_time: '与真实时间之比', slipped: '滑移', theme: '深色或浅色',
  other_language: 'English', other_language_label: 'English (switch language)',
  token: '令牌', token_why: '这个 lk-emu 可以从别的机器访问，需要出示令牌。', enter: '确定',
  read_only: '只能查看', may_act_with: 'lk-emu --http-write 允许本页面操作',
  lost: 'lk-emu 没有应答。现在显示的是断开前的内容；每秒重试一次。',
  load_of: '{bus} 的负载率', bus_rate: '{bus}，{rate} kbit/s', bus_no_time: '{bus}：帧不占时间', down: '断开',
  drive: '驱动器 {name}', drives: '驱动器', all: '全部', none: '都不选', set: '设定', stop: '停止', start: '开始', clear: '清除', resume: '继续', pause: '暂停',
  realtime: '实时', stepped: '步进',

  // 总线
  speed: '速度', current: '电流', power_share: '功率', voltage: '母线', motor: '电机', stage: '驱动', replies: '回复',
  speed_about: '驱动器报告的速度，转子侧', current_about: '转矩电流，测量值', voltage_about: '母线电压，测量值',
  motor_about: '电机温度，测量值', stage_about: '功率级温度，测量值',
  replies_about: '每秒（仿真时间）的回复数',
  per_second: '/s', no_power: '没有电', no_errors: '没有错误', running: '运行', stopped: '停止', off: '关闭',
  scope_link: '示波器', bench_link: '试验台', traffic_link: '报文',
  scope_of: '驱动器 {name} 的示波器', bench_of: '驱动器 {name} 的试验台', traffic_of: '驱动器 {name} 的报文',
  shaft_at: '{label}，输出轴在 {angle}',
  summary: '{drives} 个驱动器：{running} 个运行，{errors} 个有错误，{dead} 个没有电；每秒 {replies} 个回复',

  // 建议
  advice: '建议', advice_about: '主机的哪些做法在真的驱动器上会出问题', advice_none: '目前没有。',
  advice_times: '{n} 次，首次在 {time} s', advice_frame: '看这一帧', advice_todo: '怎么办：',

  // 示波器
  width: '显示', width_label: '显示多少秒', rate: '采样率', rate_label: '每秒采样数', zoom_in: '放大', zoom_out: '缩小', earlier: '往前', later: '往后',
  cursor_label: '放游标 {name}', no_cursors: '去掉游标', no_cursors_about: '去掉两个游标', csv_about: '保存画面中的内容',
  signal_sets: '信号组', signals: '信号', all_signals: '全部信号', all_drives: '全部驱动器', drive_label: '驱动器 {name}',
  group_position: '位置', group_speed: '速度', group_current: '电流', group_phases: '相电流', group_duties: '占空比',
  group_temperatures: '温度', group_supply: '供电',
  scope_info: '每秒 {frames} 幅，已存 {kept} s', scope_lost: '，丢了 {n} 个采样', scope_reduced: '，实际采样率 {rate} Hz：再高就太多了',
  scope_refused: '，收不到 {bus} 的采样：lk-emu 没有打开数据流；可能已被其他页面占满', no_such_drive: '没有驱动器 {name}',
  plots_label: '曲线。空格暂停，加减号缩放，左右箭头移动，a 和 b 放游标，Esc 去掉游标。',
  plot_of: '单位为 {unit} 的信号：{traces}', trace: '曲线', now: '现在', least: '最小', most: '最大',
  between: 'B − A = {ms} ms，{hz} Hz。最小和最大取自两个游标之间。',
  in_view: '{s} s。最小和最大取自整个画面。', in_view_held: '已暂停：第一次点击放游标 A，第二次放 B。最小和最大取自整个画面。',
  csv_saved: '已保存 {from} s 到 {to} s 的 {rows} 个采样', csv_nothing: '没有可保存的内容',
  not_watched: '那时示波器还没有开始观察这个驱动器', mark_frame: '帧',
  unit_duty: '占空比', unit_counts: '计数', unit_power: '电压占比', unit_state: '状态',

  // 报文
  show: '显示', both_ways: '两个方向', queries: '命令帧', replies_only: '回复帧', commands: '命令', with_text: '包含', any_text: '任意文字',
  marked_only: '只看错误和建议', frames_label: '帧', frames_scroller: '帧，从旧到新',
  head_time: '时间，s', head_gap: '间隔，ms', head_way: '方向', head_command: '命令', head_name: '名称', head_says: '内容', head_frame: '帧',
  to_all: '全部', instant_in_scope: '示波器上的这一刻，{time} s',
  frames_info: '{all} 帧中的 {shown} 帧', frames_lost: '，来不及送到的有 {n} 帧',
  frame_gone: '{time} s 的那一帧不在这里：已经太旧，或者那时还没有打开过本视图。',

  // 试验台
  page_read_only: '本页面只能查看。启动 lk-emu 时加上 --http-write 才能操作。',
  for_drives: '作用于驱动器', drives_meant: '作用于哪些驱动器', choose_first: '先选一个驱动器', needs_number: '{name}：请填一个允许的数值',
  shaft: '输出轴', clock_title: '时钟', supply_and_ambient: '供电与环境', load: '负载', inject_fault: '注入故障', scenario: '场景', evidence: '故障及其证据',
  shaft_by_hand: '用手转动的输出轴', turn_hint: '用手转动输出轴：拖动，或用方向键', drag_hint: '拖动表盘，或用方向键。',
  no_drive: '没有选驱动器', shaft_angle: '输出轴', target_angle: '给定', supply_current: '供电电流', page_only_looks: '本页面只能查看',
  power: '电源', power_on: '通电', power_off: '断电', cycle: '断电重启', off_for: '断电', off_for_label: '断电多久，s',
  power_is_on: '已通电', power_is_off: '已断电', power_cycled: '断电 {s} s 后再通电',
  supply: '供电电压', supply_label: '供电电压，V', within: '历时', within_label: '历时，s', set_supply: '设定供电电压', supply_goes: '供电电压变到 {V} V',
  sag_to: '跌落到', sag_to_label: '跌落到，V', sag_for: '持续', sag_for_label: '持续，s', sag: '跌落', sag_done: '跌落到 {V} V',
  ambient: '环境温度', ambient_label: '环境温度，°C', set_ambient: '设定环境温度', ambient_is: '环境温度为 {C} °C',
  now_supplied: '驱动器 {name} 现在：{power}，{V} V，周围 {C} °C。', now_on: '已通电', now_off: '已断电',
  inertia: '转动惯量', inertia_about: '输出轴上', torque: '转矩', torque_about: '恒定，正值推向顺时针',
  gravity: '重力', gravity_about: '摆臂的 m·g·l：转矩为 −重力·sin(角度)', stop_from: '限位从', stop_to: '到', stop_about: '输出轴的机械限位；空着就是没有',
  set_load: '设定负载', as_now: '取当前值', load_is: '负载已更换', load_now: '驱动器 {name} 现在：{text}',
  clock_is: '时钟：{mode}', time_is: '现在是 {s} s', real_time: '实时', time_stands: '时间静止', scale: '变速', step: '推进', by: '推进',
  end: '结束', end_about: '结束正在进行的推进',
  clock_says: '仿真时间 {time}，{mode}', clock_advancing: '，正在推进', clock_slipped: '；滑移了 {s} s：机器太忙',
  fault: '故障', inject: '注入', of_whole_bus: '（整条总线）', needed: '必填', until_cleared: '直到清除', once: '一次', no_end: '不限',
  from_to: '{min} 到 {max}', fault_injected: '已注入 {names}', fault_cleared: '已清除 {name}', clear_fault: '清除 {name}', clear_all: '全部清除', all_cleared: '一切恢复正常',
  fault_name: '名称', fault_state: '状态', fault_of: '对象', fault_parameters: '参数', fault_began: '开始', fault_first: '首次生效', fault_effects: '生效次数',
  fault_first_on: '首次作用于', nothing_yet: '还没有', no_faults: '还没有注入过故障。',
  choose_one: '请选择', shipped: '自带的', or_file: '或用文件', has_begun: '{name} 已开始', ended: '已结束',
  scenario_at: '{name}，{time} / {all} s', took_effect: '已生效', no_effect: '未生效',
};

// All words of the page, in English and in Chinese. {n} is put in.

const kWords = {
  to_content: ['To the content', '跳到内容'],
  places: ['Sections', '各部分'],
  theme: ['Dark or light', '深色或浅色'],
  other_language: ['中文', 'English'],
  other_language_label: ['中文：换成中文', 'English: change to English'],

  overview: ['Overview', '概览'],
  comparison: ['Since last time', '与上次相比'],
  matrix: ['Outcomes', '故障与结果'],
  coverage: ['Coverage', '覆盖率'],
  latency: ['Latency', '检测延迟'],
  space: ['Space', '覆盖的空间'],
  smallest: ['Smallest cases', '最小用例'],
  residual: ['Residual cases', '剩余问题'],
  plan: ['Plan', '计划'],

  not_fired: ['not fired', '未触发'],
  no_effect: ['no effect', '无影响'],
  tolerated: ['tolerated', '可容忍'],
  detected_by_drive: ['detected by the drive', '驱动器检出'],
  detected_by_host: ['detected by the host', '主机检出'],
  late: ['late', '检出过晚'],
  silently_wrong: ['silently wrong', '出错却无人察觉'],
  hang: ['hang', '卡住'],
  crash: ['crash', '崩溃'],

  fault: ['fault', '故障'],
  all: ['all', '全部'],
  cases: ['cases', '用例'],
  cases_of: ['{n} of {all} cases', '{all} 个用例中的 {n} 个'],
  sampled: ['sampling {sampling}', '抽样 {sampling}'],
  seed_is: ['seed {seed}', '种子 {seed}'],
  tolerant_time: ['fault-tolerant time {time} s', '容错时间 {time} s'],
  version: ['lk-emu {version}', 'lk-emu {version}'],
  real_time: ['{n} in real time, {flipped} of them with runs that differ in their outcome',
    '{n} 个实时运行，其中 {flipped} 个各次结果不同'],
  failures: ['failures', '失败'],
  failures_about: ['late, silently wrong, hung or crashed', '过晚、无人察觉、卡住或崩溃'],
  detected_in_time: ['{n} of {all} dangerous cases were detected in time', '{all} 个危险用例中 {n} 个及时检出'],
  no_danger: ['no case was dangerous', '没有危险用例'],
  required: ['Required', '要求'],
  holds: ['holds', '满足'],
  fails: ['fails', '不满足'],
  measured: ['measured {value}', '实测 {value}'],
  but_missing: ['but {n} cases are missing', '但缺少 {n} 个用例'],
  nothing_measured: ['nothing to measure', '无可测量'],
  required_none: ['nothing was required', '没有提出要求'],

  matrix_about: ['How many cases of each fault came to what. A number with a frame leads to its cases below.',
    '每种故障的用例各有什么结果。带边框的数字通往下面的用例。'],
  show_cases: ['{fault}, {outcome}: {n} cases, show them', '{fault}，{outcome}：{n} 个用例，查看'],

  coverage_about: ['Detected in time, of all that was dangerous: detected, late, silently wrong, hung or crashed. A fault that did not take effect is never counted.',
    '及时检出的用例占全部危险用例（检出、过晚、无人察觉、卡住、崩溃）的比例。未触发的故障从不计入。'],
  interval_about: ['Intervals: Clopper and Pearson, 95 %.', '区间：Clopper–Pearson，95 %。'],
  no_claim: ['No claim: bounds need sampling = "random", and this campaign has "{sampling}". Counts are exact for what was run.',
    '不作断言：置信界需要 sampling = "random"，而本次为 "{sampling}"。计数对已运行的用例是准确的。'],
  detected_of: ['in time / dangerous', '及时 / 危险'],
  share: ['coverage', '覆盖率'],
  interval: ['95 % interval', '95 % 区间'],
  to_claim: ['to claim {claim} %', '要断言 {claim} %'],
  met: ['reached', '已达到'],
  needs: ['{n} more, all in time', '还需 {n} 个且全部及时'],
  needs_share: ['{n} more, or {more} at this share', '还需 {n} 个且全部及时，或按现比例 {more} 个'],
  not_at_this_share: ['{n} more, all in time; not at this share', '还需 {n} 个且全部及时；按现比例达不到'],

  latency_about: ['From the first effect to the detection, in time or not; p50 and p99 are nearest ranks.',
    '从首次产生影响到检出（无论是否及时）；p50 与 p99 按最近秩取值。'],
  who_first: ['whoever was first', '最先检出者'],
  who_drive: ['by the drive', '驱动器'],
  who_host: ['by the host', '主机'],
  who: ['Detected', '检出者'],
  worst: ['worst', '最长'],
  rounded: ['p50 and p99 are rounded up.', 'p50 与 p99 已向上取整。'],
  tolerant_line: ['The line is the fault-tolerant time, {time} s.', '竖线为容错时间 {time} s。'],
  none_detected: ['Nothing was detected.', '没有检出。'],

  space_about: ['Where faults met the drive: its state and the latest command that it had heard. Hatched: never met.',
    '故障发生时驱动器的状态及其最近收到的命令。斜线：从未遇到。'],
  space_met: ['{n} of {all} combinations were met, {holes} never.', '{all} 种组合中遇到 {n} 种，{holes} 种从未遇到。'],
  only_holes: ['only faults with holes', '只看有空缺的故障'],
  hole: ['never met', '从未遇到'],
  cell_about: ['{n} cases, {failures} failures', '{n} 个用例，{failures} 个失败'],
  off: ['off', '关闭'],
  stopped: ['stopped', '停止'],
  running: ['running', '运行'],
  unknown: ['unknown', '未知'],
  none: ['none', '无'],
  any: ['any', '任意'],

  search: ['Search', '搜索'],
  every_fault: ['every fault', '所有故障'],
  every_outcome: ['every outcome', '所有结果'],
  shown: ['{from} to {to} of {all}', '第 {from} 至 {to} 个，共 {all} 个'],
  shown_none: ['no case fits', '没有符合的用例'],
  no_residual: ['No case was late, silently wrong, hung or crashed.', '没有过晚、无人察觉、卡住或崩溃的用例。'],
  left_out: ['{n} more cases are in the results only.', '另有 {n} 个用例仅在结果文件中。'],
  earlier: ['Previous', '上一页'],
  later: ['Next', '下一页'],
  number: ['case', '用例'],
  outcome: ['outcome', '结果'],
  before: ['was', '上次'],
  effect_at: ['first effect, s', '首次影响，s'],
  detected_after: ['detected after, s', '检出延迟，s'],
  violated_at: ['violated at, s', '违反于，s'],
  margin: ['margin', '余量'],
  violated: ['what was violated', '违反了什么'],
  sort_by: ['sort by {column}', '按 {column} 排序'],
  details: ['case {n}, details', '用例 {n} 的详情'],
  values: ['values', '取值'],
  fault_at: ['fault began', '故障开始'],
  by_drive_at: ['detected by the drive', '驱动器检出'],
  by_host_at: ['detected by the host', '主机检出'],
  met_in: ['met the drive', '遇到驱动器时'],
  state_and_command: ['{state}, latest command {command}', '{state}，最近命令 {command}'],
  note: ['note', '备注'],
  runs: ['runs', '运行'],
  runs_about: ['{n} in real time, {flips} with another outcome', '实时 {n} 次，{flips} 次结果不同'],
  again: ['runs it again', '重新运行'],
  copy: ['Copy', '复制'],
  copied: ['Copied.', '已复制。'],
  not_copied: ['The browser does not let this page copy.', '浏览器不允许此页面复制。'],

  smallest_about: ['For each fault and outcome the case with the least severity and the shortest time that still has it.',
    '每种故障与结果中仍能重现的、强度最小且时间最短的用例。'],
  picture_of: ['Picture of case {n}', '用例 {n} 的图'],

  worse: ['worse', '变差'],
  better: ['better', '变好'],
  same: ['same outcome', '结果相同'],
  cases_worse: ['{n} cases worse', '{n} 个用例变差'],
  not_compared: ['Not compared: {before} without a result now, {now} without one before, {not_fired} that did not fire before or now.',
    '未比较：{before} 个现在没有结果，{now} 个上次没有结果，{not_fired} 个有一次未触发。'],
  changed: ['The plan or a file that it names has changed in between (lk-emu {version} before).',
    '其间计划或其引用的文件有变化（上次为 lk-emu {version}）。'],
  moves_about: ['Rows: outcome before; columns: now.', '行：上次的结果；列：现在的结果。'],
  worse_list: ['Cases that became worse', '变差的用例'],
};

const kKeptLanguage = 'lk-emu-lang';

/// What was chosen may not be kept where the page is a file of some browsers.
function kept(key) {
  try {
    return localStorage.getItem(key);
  } catch {
    return null;
  }
}

function keep(key, value) {
  try {
    localStorage.setItem(key, value);
  } catch {
    // then it is asked for again
  }
}

let language = (new URLSearchParams(location.search).get('lang') ?? kept(kKeptLanguage) ?? navigator.language)
  .toLowerCase().startsWith('zh') ? 'zh' : 'en';

function switchLanguage() {
  language = language === 'zh' ? 'en' : 'zh';
  keep(kKeptLanguage, language);
}

const hasWord = (key) => Object.hasOwn(kWords, key);

/// t('cases_of', {n: 3, all: 7})
function t(key, values = {}) {
  return kWords[key][language === 'zh' ? 1 : 0].replace(/\{(\w+)\}/g, (all, name) => values[name] ?? all);
}

/// A word that comes from the results: translated where it is known.
const wordOf = (word) => (hasWord(word) ? t(word) : word);

/// A kind of fault, as plans write it; in Chinese its name goes before.
function faultWord(kind) {
  if (kind === '' || kind === 'any' || kind === 'none') return t(kind || 'all');
  const names = kChineseFaults.fault_names;
  return language === 'zh' && Object.hasOwn(names, kind) ? `${names[kind]} ${kind}` : kind;
}

function translatePage() {
  document.documentElement.lang = language === 'zh' ? 'zh-CN' : 'en';
  for (const node of document.querySelectorAll('[data-t]')) node.textContent = t(node.dataset.t);
  for (const node of document.querySelectorAll('[data-t-label]')) {
    node.setAttribute('aria-label', t(node.dataset.tLabel));
    if (node.title) node.title = t(node.dataset.tLabel);
  }
}

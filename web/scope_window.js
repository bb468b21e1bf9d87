// Time window of the scope (newest, triggered or past) and the cursors in it.

const kShortest_s = 0.001;
const kLongest_s = 600;

const within = (s) => Math.min(kLongest_s, Math.max(kShortest_s, s));

export class ScopeWindow {
  /// `newest` returns the time of the newest sample. `onHold` is called when the held window has changed, `onRelease`
  /// when the scope runs again, `onWidth` with a new width.
  constructor({newest, trigger, onHold, onRelease, onWidth}) {
    Object.assign(this, {newest, trigger, onHold, onRelease, onWidth});
    this.width_s = 5;
    this.held = null;   // {from_s, to_s}: paused there
    this.cursors = {A: null, B: null};
    this.mark_s = null;  // instant of the link that opened the view
  }

  get span() {
    const to_s = this.newest();
    return this.held ?? this.trigger.window(to_s, this.width_s) ?? {from_s: to_s - this.width_s, to_s};
  }

  /// Whether the window is stationary, because of a pause or the trigger.
  get stands() {
    return this.held !== null || this.trigger.window(this.newest(), this.width_s) !== null;
  }

  hold(from_s, to_s) {
    this.held = {from_s, to_s};
    this.onHold();
    this.onWidth(to_s - from_s);
  }

  release() {
    if (this.held) this.width_s = within(this.held.to_s - this.held.from_s);
    this.held = null;
    this.mark_s = null;
    this.onRelease();
    this.onWidth(this.width_s);
  }

  pause() {
    if (this.held) return this.release();
    const {from_s, to_s} = this.span;
    this.hold(from_s, to_s);
  }

  zoom(factor, around_s = null) {
    if (!this.held) {
      this.width_s = within(this.width_s * factor);
      this.onWidth(this.width_s);
      return;
    }
    const {from_s, to_s} = this.held;
    const next = within((to_s - from_s) * factor);
    const middle = around_s ?? (from_s + to_s) / 2;
    const share = (middle - from_s) / (to_s - from_s);
    this.hold(middle - next * share, middle + next * (1 - share));
  }

  setWidth(s) {
    if (this.held) this.zoom(s / (this.held.to_s - this.held.from_s));
    else this.width_s = within(s);
  }

  pan(share) {
    const {from_s, to_s} = this.span;
    const by = (to_s - from_s) * share;
    this.hold(from_s + by, to_s + by);
  }

  putCursor(name, time_s) {
    if (!this.held) this.pause();
    this.cursors[name] = time_s;
  }

  /// Sets a cursor at a share of the window.
  putCursorAt(name, share) {
    const {from_s, to_s} = this.span;
    this.putCursor(name, from_s + (to_s - from_s) * share);
  }

  clearCursors() {
    this.cursors = {A: null, B: null};
  }
}

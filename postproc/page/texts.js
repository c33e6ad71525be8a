// CL file and programs line by line; a text is unpacked when it is first asked for.
const ROW = 18, TALLEST = 8e6;

class Texts {
  constructor(box, chosen) {
    this.box = box; this.chosen = chosen; this.known = new Map(); this.kind = null; this.here = -1;
    this.room = make("div", {});
    box.append(this.room);
    box.addEventListener("scroll", () => this.draw());
    box.addEventListener("keydown", (e) => {
      const step = {ArrowDown: 1, ArrowUp: -1, PageDown: 12, PageUp: -12}[e.key];
      if (step && this.lines) { e.preventDefault(); this.show(Math.min(Math.max(this.here + step, 1), this.lines.length)); }
      if (e.key === "Enter" && this.here > 0) { e.preventDefault(); this.chosen(this.kind, this.here); }
    });
  }

  has(kind) { return byId("text-" + kind) !== null; }

  async open(kind) {
    if (this.kind === kind) return true;
    if (!this.has(kind)) return false;
    if (!this.known.has(kind)) {
      const bytes = await inflated(byId("text-" + kind).textContent);
      this.known.set(kind, new TextDecoder("utf-8").decode(bytes).split(/\r\n|\r|\n/));
    }
    this.kind = kind; this.lines = this.known.get(kind); this.here = -1; this.box.scrollTop = 0;
    this.tall = Math.min(this.lines.length * ROW, TALLEST);
    this.room.style.height = this.tall + "px";
    this.draw();
    return true;
  }

  close() { this.kind = null; this.lines = null; this.here = -1; this.room.replaceChildren(); }

  // First line in sight: very long texts scroll in shares of their length.
  first() {
    const seen = Math.floor(this.box.clientHeight / ROW), most = Math.max(this.lines.length - seen, 0);
    const range = Math.max(this.tall - this.box.clientHeight, 1);
    return this.tall < TALLEST ? Math.floor(this.box.scrollTop / ROW) : Math.round(this.box.scrollTop / range * most);
  }

  draw() {
    if (!this.lines) return;
    const first = this.first(), count = Math.ceil(this.box.clientHeight / ROW) + 1, rows = [];
    const top = this.tall < TALLEST ? first * ROW : this.box.scrollTop;
    for (let k = first; k < Math.min(first + count, this.lines.length); k++) {
      const row = make("div", {class: "row" + (k + 1 === this.here ? " here" : ""), role: "option", "aria-selected": String(k + 1 === this.here),
        onclick: () => { this.here = k + 1; this.draw(); this.chosen(this.kind, k + 1); }},
      make("b", {}, String(k + 1)), this.lines[k].slice(0, 2000));
      row.style.top = top + (k - first) * ROW + "px";
      rows.push(row);
    }
    this.room.replaceChildren(...rows);
  }

  show(line) {
    this.here = line;
    const seen = Math.floor(this.box.clientHeight / ROW), first = Math.max(line - 1 - Math.floor(seen / 2), 0);
    const most = Math.max(this.lines.length - seen, 1), range = Math.max(this.tall - this.box.clientHeight, 0);
    this.box.scrollTop = this.tall < TALLEST ? first * ROW : first / most * range;
    this.draw();
  }

  // The next line that holds the words, from the one that is shown; 0 where none does.
  find(words, direction) {
    if (!this.lines || !words) return 0;
    const wanted = words.toLowerCase(), n = this.lines.length, from = Math.max(this.here, 0);
    for (let k = 1; k <= n; k++) {
      const at = ((from - 1 + direction * k) % n + n) % n;
      if (this.lines[at].toLowerCase().includes(wanted)) return at + 1;
    }
    return 0;
  }
}

// The polytope of a pass: what the tip may do under the CL file's tool axis and under the chosen one, seen across the cut.
const SOLIDS = [["cl_file", "axis of the CL file", "#6b7280", "5 4"], ["chosen", "chosen axis", "#0072b2", ""]];
const LOOKS_DOWN = 24 * Math.PI / 180, OFF_THE_CUT = 62 * Math.PI / 180; // of the view: below the horizon, beside the cut

function polytopeParts(found) {
  const drawn = (found.polytopes || []).map((one, k) => [one, k]).filter((pair) => pair[0] && (pair[0].cl_file || pair[0].chosen));
  if (!drawn.length) return [make("p", {class: "note"}, "No polytope: no limit of an axis bounds these passes.")];
  const choice = make("select", {id: "polytope-pass"}, ...drawn.map(([, k]) => make("option", {value: k}, `pass ${found.passes[k].pass}, line ${found.passes[k].line}`)));
  const place = make("div", {id: "polytope"}), show = () => place.replaceChildren(polytopeFigure(found.polytopes[Number(choice.value)]));
  choice.addEventListener("change", show);
  choice.value = String(drawn.some(([, k]) => k === found.most_gaining) ? found.most_gaining : drawn[0][1]);
  show();
  return [make("h3", {}, "What the axes allow the tip (polytope)"),
    make("p", {}, "The surface of the solid is the most that all axes together allow the tip of the tool in each direction, with the tool held still along one axis. The line with the dot is the direction of the cut: the further out the dot, the sooner the cut is done."),
    make("label", {}, "Pass ", choice), place,
    found.passes.length > found.polytopes.length ? make("p", {class: "note"}, `Drawn for the first ${found.polytopes.length} of ${found.passes.length} passes.`) : null].filter(Boolean);
}

function polytopeFigure(one) {
  const known = SOLIDS.map(([key, name, colour, dash]) => [one[key], name, colour, dash]).filter(([solid]) => solid);
  const along = known[known.length - 1][0].reach, turn = Math.atan2(along[1], along[0]) - OFF_THE_CUT;
  const right = [-Math.sin(turn), Math.cos(turn), 0], up = [-Math.sin(LOOKS_DOWN) * Math.cos(turn), -Math.sin(LOOKS_DOWN) * Math.sin(turn), Math.cos(LOOKS_DOWN)];
  const size = Math.max(...known.flatMap(([solid]) => [...solid.corners, solid.reach].map((p) => Math.hypot(...p))), 1e-12);
  const half = 210, wide = 720, scale = half * 0.82 / size, at = (p) => [half + scale * dot3(right, p), half - scale * dot3(up, p)];
  const what = {velocity: "speed", acceleration: "acceleration", jerk: "jerk"}[one.order];
  const drawn = svg("svg", {viewBox: `0 0 ${wide} ${2 * half}`, role: "img", width: "100%", style: "max-width: 720px",
    "aria-label": `Largest ${what} of the tip in each direction, ${one.unit}: ` + known.map(([solid, name]) => `${name} ${short3(solid.rate)}`).join(", ")});
  const line = (a, b, colour, width, dash) => { const [x1, y1] = at(a), [x2, y2] = at(b); drawn.append(svg("line", {x1, y1, x2, y2, stroke: colour, "stroke-width": width, "stroke-dasharray": dash})); };
  ["x", "y", "z"].forEach((name, k) => {
    const end = [0, 1, 2].map((j) => (j === k ? size * 0.95 : 0)), [x, y] = at(end);
    line([0, 0, 0], end, "#9aa1a9", 1, "");
    drawn.append(svg("text", {x: x + 4, y: y - 3}, name));
  });
  known.forEach(([solid, name, colour, dash], n) => {
    for (const [a, b] of solid.edges) line(solid.corners[a], solid.corners[b], colour, 1.4, dash);
    line([0, 0, 0], solid.reach, colour, 3, dash);
    const [cx, cy] = at(solid.reach), y = 40 + 44 * n;
    drawn.append(svg("circle", {cx, cy, r: 5, fill: colour}), svg("line", {x1: 2 * half + 10, y1: y - 4, x2: 2 * half + 46, y2: y - 4, stroke: colour, "stroke-width": 3, "stroke-dasharray": dash}),
      svg("text", {x: 2 * half + 54, y}, name), svg("text", {x: 2 * half + 54, y: y + 16}, `${short3(solid.rate)} ${one.unit} along the cut`));
  });
  drawn.append(svg("text", {x: 2 * half + 10, y: 40 + 44 * known.length}, `largest ${what} of the tip, ${one.unit};`), svg("text", {x: 2 * half + 10, y: 56 + 44 * known.length}, `lines x, y, z of the part are ${short3(size * 0.95)} ${one.unit} long`));
  return make("div", {class: "scroll"}, drawn);
}

const short3 = (v) => String(Number(v.toPrecision(3)));

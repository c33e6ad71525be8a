// What geometric errors do at places of the part, as lines from each: before and after correction, on one scale.
const BEFORE_COLOUR = [213, 94, 0], AFTER_COLOUR = [0, 114, 178];

// Lines of the vectors, the longest before correction `longest` mm long in the picture.
function errorLines(errors, longest, lines) {
  const scale = longest / Math.max(errors.worst_before_um, 1e-9);
  for (const place of errors.places) {
    for (const [vector, colour] of [[place.vector_um, BEFORE_COLOUR], [place.vector_after_um, AFTER_COLOUR]]) {
      lines.push([...place.part_mm, ...place.part_mm.map((v, k) => v + scale * vector[k]), ...colour]);
    }
  }
}

function errorLegend(errors) {
  const sure = errors.uncertainty_k2_um === null ? "" : `, uncertainty (k = 2) ${number(errors.uncertainty_k2_um, 2)} um`;
  return [{colour: BEFORE_COLOUR, text: `error before correction, longest ${number(errors.worst_before_um, 2)} um${sure}`},
    {colour: AFTER_COLOUR, text: `after, on the same scale, longest ${number(errors.worst_after_um, 3)} um`}];
}

// What geometric errors do at places of the part, as lines from each: before and after correction, on one scale.
const BEFORE_COLOUR = [213, 94, 0], AFTER_COLOUR = [0, 114, 178], UNSURE_COLOUR = [110, 110, 110];

// Lines of the vectors, the longest before correction `longest` mm long in the picture; a cross at the end of each reaches as
// far as its uncertainty (k = 2), where that is known.
function errorLines(errors, longest, lines) {
  const scale = longest / Math.max(errors.worst_before_um, 1e-9);
  for (const place of errors.places) {
    for (const [vector, colour] of [[place.vector_um, BEFORE_COLOUR], [place.vector_after_um, AFTER_COLOUR]]) {
      const end = place.part_mm.map((v, k) => v + scale * vector[k]), far = scale * (place.uncertainty_k2_um || 0);
      lines.push([...place.part_mm, ...end, ...colour]);
      for (let j = 0; far > 0 && j < 3; j++) {
        const arm = (side) => end.map((v, k) => v + (k === j ? side * far : 0));
        lines.push([...arm(-1), ...arm(1), ...UNSURE_COLOUR]);
      }
    }
  }
}

function errorLegend(errors) {
  return [{colour: BEFORE_COLOUR, text: `error before correction, longest ${number(errors.worst_before_um, 2)} um`},
    {colour: AFTER_COLOUR, text: `after, on the same scale, longest ${number(errors.worst_after_um, 3)} um`},
    ...(errors.uncertainty_k2_um === null ? [] : [{colour: UNSURE_COLOUR,
      text: `crosses: uncertainty of each (k = 2), largest ${number(errors.uncertainty_k2_um, 2)} um`}])];
}

// Registration points in the room: crosses of three arms, which no coil looks like, whatever colours one can tell apart.
import {add, scale, sub, unit} from "./math.js";
import {append, empty, rgb, tube} from "./mesh.js";

export const POINT_COLOUR = "#7cc0ff";
const ARM_MM = 6;
const ARM_RADIUS_MM = 0.7;
const TOUCH_RADIUS_MM = 1.3;
const AXES = [[1, 0, 0], [0, 1, 0], [0, 0, 1]];

// [{name, p, touched}] as triangles; a line leads to where a point was touched, and ends in a ball.
export function cross_mesh(points) {
  const mesh = empty(), colour = [...rgb(POINT_COLOUR), 1];
  const rod = (a, b, radius) => append(mesh, tube([...a, ...b], () => radius, () => colour));
  for (const {p, touched} of points) {
    for (const axis of AXES) rod(add(p, scale(axis, ARM_MM)), sub(p, scale(axis, ARM_MM)), ARM_RADIUS_MM);
    if (!touched) continue;
    rod(p, touched, ARM_RADIUS_MM / 2);
    append(mesh, ball(touched, TOUCH_RADIUS_MM, colour));
  }
  return mesh;
}

// A short tube whose radius goes round.
function ball(centre, radius, colour) {
  const steps = [-1, -0.8, -0.4, 0, 0.4, 0.8, 1], along = [0, 0, radius];
  const line = steps.flatMap((step) => add(centre, scale(along, step)));
  const mesh = tube(line, (i) => radius * Math.sqrt(1.0001 - steps[i] ** 2), () => colour);
  for (let i = 0; i < mesh.normal.length; i += 3) {
    const n = unit(sub(mesh.position.slice(i, i + 3), centre));
    for (let k = 0; k < 3; ++k) mesh.normal[i + k] = n[k];
  }
  return mesh;
}

// May the shape be believed, and if not, why. Pure.

// The contract's: an older shape is none.
export const SILENCE_MS = 250;

export const ORIGINS = {DEMO_DATA: "DEMO", REPLAY_DATA: "REPLAY"};

const WORDS = {
  EM_STALE: "the tracker sends nothing new",
  EM_STUCK: "the tracker repeats the same values",
  COIL_LOST: "a coil is missing",
  COIL_OUTLIER: "a coil contradicts the others",
  OUT_OF_VOLUME: "a coil is outside the tracker's volume",
  IMAGE_OFF: "fluoroscopy is off: shape from the coils alone",
  IMAGE_STALE: "an image was due and did not come",
  IMAGE_REJECTED: "the image is refused",
  IMAGE_LOST_TUBE: "the image does not show the tube where it should be",
  NOT_CONVERGED: "the estimate did not settle",
  NO_REGISTRATION: "tracker and world are not registered",
  CLOCK_UNSYNCED: "this host's clock follows no reference",
  DEADLINE_MISSED: "the estimate came late",
  INITIALISING: "starting: not enough measurements yet",
  RIVAL_WRITER: "another program publishes under this instrument's name",
  GEOMETRY_CHANGED: "table or C-arm moved and no pose said so: images of that view are left out",
  REFERENCE_LOST: "the reference on the patient is missing, contradicts itself or has jumped",
  EM_IMAGE_DISAGREE: "coils and images contradict each other: the status says what explains it best",
  AMBIGUOUS: "the tip may have another shape that fits as well: a second view, a coil nearer to the tip or rest_shape in the configuration decides",
  TIP_NOT_SEEN: "coils or images at the tip contradict the shape it is taken to have, or no image has shown it yet",
};

export const words_of = (reason) => WORDS[reason] ?? reason.toLowerCase().replaceAll("_", " ");

const CLASSES = {VALID: "valid", QUESTIONABLE: "questionable"};

const seconds = (ms) => (ms < 9950 ? (ms / 1000).toFixed(1) : Math.round(ms / 1000)) + " s";

// Of one instrument: `sample` is its newest or null, `age_ms` of it. {class, word, reasons, is_shown}
export function state_of(sample, age_ms, is_connected, is_recording = false) {
  if (!is_connected) return silent(`no connection to ${is_recording ? "tubectl view" : "tubed-view"}; trying again`);
  if (!sample) return silent(is_recording ? "the first shape of the recording is being made" : "tubed has sent no shape yet");
  if (age_ms > SILENCE_MS) return silent(`no sample for ${seconds(age_ms)}: ${is_recording ? "tubectl view" : "tubed or tubed-view"} hangs or has ended`);
  const reasons = sample.reasons.filter((reason) => !(reason in ORIGINS)).map(words_of);
  const is_shape = sample.validity in CLASSES && sample.points.length >= 6;
  return {
    class: is_shape ? CLASSES[sample.validity] : "none",
    word: is_shape || sample.validity !== "NOT_AVAILABLE" ? sample.validity : "NO SHAPE",
    reasons, is_shown: is_shape, is_silent: false,
  };
}

const silent = (reason) => ({class: "none", word: "NO SHAPE", reasons: [reason], is_shown: false, is_silent: true});

// Of several instruments: the worst.
export function worst(states) {
  const rank = {valid: 0, questionable: 1, none: 2};
  return states.reduce((a, b) => (rank[b.state.class] > rank[a.state.class] ? b : a));
}

// "cath-1-em" in mode em is where the coils alone put "cath-1": it is drawn beside it and has no state of its own.
export function companion_of(id, modes) {
  const other = `${id}-em`;
  return modes.get(other) === "em" && modes.get(id) !== "em" ? other : null;
}
export const is_companion = (id, modes) =>
  id.endsWith("-em") && modes.get(id) === "em" && modes.has(id.slice(0, -3)) && modes.get(id.slice(0, -3)) !== "em";

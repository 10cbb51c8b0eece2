// Changes on their way to the program: each arrives, once, in the order of the gestures.
const noChanges = () => ({
  page: Array.from(crypto.getRandomValues(new Uint8Array(16)), (byte) => byte.toString(16)).join("."),
  queue: [],    // Not yet confirmed, the oldest first.
  sent: 0,      // So many of them are on their way, and stay as they are.
  next: 1,      // Number of the first. The program skips numbers that it had: what is sent again counts once.
  version: 0,   // Of the first status that knows of all that were confirmed.
});
let changes = noChanges();
let sending = false;
const mostAtOnce = 100;

/// Combines two changes of one key into one: within the limits of the program, or null.
const within = (least, most, value) => value >= least && value <= most ? value : null;
const sumOfPairs = (one, other) => {
  const sum = [one[0] + other[0], one[1] + other[1]];
  return sum.every((part) => within(-100, 100, part) !== null) ? sum : null;
};
const product = (one, other) => within(0.01, 100, one * other);
const newest = (one, other) => other;
const mergers = {
  orbit: sumOfPairs, pan: sumOfPairs, dolly: product, zoom: product,
  exposure_step: (one, other) => within(-100, 100, one + other),
  exposure_ev: newest, white: newest, plane: newest, samples: newest, fov_deg: newest,
};

function merged(one, other) {
  const keys = Object.keys(other), key = keys[0];
  if (keys.length !== 1 || Object.keys(one).join() !== key || !mergers[key]) return null;
  const value = mergers[key](one[key], other[key]);
  return value === null ? null : { [key]: value };
}

/// Adds a change. One that only continues the last is added to that, unless it is on its way.
function change(wanted) {
  const { queue } = changes;
  const both = queue.length > changes.sent ? merged(queue[queue.length - 1], wanted) : null;
  if (both) queue[queue.length - 1] = both;
  else queue.push(wanted);
  if (!sending) sendChanges();
}

const sleep = (milliseconds) => new Promise((done) => setTimeout(done, milliseconds));

async function sendChanges() {
  sending = true;
  while (changes.queue.length) {
    try {
      await sendSome();
    } catch {
      // They may not have arrived: send them again.
      await sleep(view.connected ? 250 : 2000);
    }
  }
  sending = false;
}

async function sendSome() {
  const mine = changes;
  const some = mine.queue.slice(0, mostAtOnce);
  mine.sent = some.length;
  const reply = await fetch(address("/change", { page: mine.page, first: mine.next }),
    { method: "POST", body: JSON.stringify(some), signal: AbortSignal.timeout(25000) });
  const text = await reply.text();
  mine.next += some.length;
  mine.sent = 0;
  mine.queue.splice(0, some.length);
  if (!reply.ok) return say(text);
  mine.version = JSON.parse(text).version;
}

/// Once all changes have arrived.
async function allArrived() {
  while (sending) await sleep(10);
}

/// True once the status includes every change; until then controls show the user's values.
function knowsAllChanges(status) {
  return !changes.queue.length && status.version >= changes.version;
}

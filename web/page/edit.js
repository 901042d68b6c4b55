
// Edits. The engine makes what is shown out of the splat as it was opened and all edits that count, so that undone is
// undone to the bit, and any number of them takes the memory of one.

const UNMOVED = {rotation: [1, 0, 0, 0, 1, 0, 0, 0, 1], translation: [0, 0, 0], scale: 1};

let edits = [];        // {action, told, moves}; `told`: of what it did, in words
let counted = 0;       // those that count; the others have been undone
let world = UNMOVED;   // where they have moved the splat that was opened
let working = false;
let tool = null;       // 'crop' or 'turn'
let box = null;        // {low, high} on the stage
let subject = null;    // what the stage says that its picture is of: {target, radius}

const dotOf = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const row = (m, k) => m.slice(3 * k, 3 * k + 3);
const column = (m, k) => [m[k], m[k + 3], m[k + 6]];
const three = (f) => [0, 1, 2].map(f);

// A look at a splat at `from`, in the world `before`, as the same look in the world `after` at a splat at `to`.
function lookAfter(look, before, from, after, to) {
  const turned = (v) => {
    const first = three((k) => dotOf(column(before.rotation, k), v));
    return three((k) => dotOf(row(after.rotation, k), first));
  };
  const size = after.scale / before.scale;
  const moved = turned(look.target.map((x, k) => x + from[k] - before.translation[k]));
  return {...look, axes: look.axes.map(turned), up: turned(look.up), distance: size * look.distance,
    target: moved.map((x, k) => size * x + after.translation[k] - to[k])};
}

const isEdited = () => counted > 0;
const isMoved = () => edits.slice(0, counted).some((edit) => edit.moves);

function forgetEdits() {
  edits = [];
  counted = 0;
  world = UNMOVED;
  byId('edited').textContent = '';
}

function offerEdits() {
  const free = input !== null && running === null && !working;
  for (const id of ['crop', 'turn', 'floaters', 'centre']) byId(id).disabled = !free;
  byId('undo').disabled = !free || counted === 0;
  byId('redo').disabled = !free || counted === edits.length;
  for (const id of ['keep', 'remove']) byId(id).disabled = !free || box === null;
  byId('upright').disabled = !free;
  byId('centre').disabled ||= subject === null;
  byId('enhance').disabled ||= working;
  byId('download').disabled = working;
}

// Tools: one at a time.

function tell(message) { if (viewer.contentWindow) viewer.contentWindow.postMessage(message, '*'); }

function setTilt(degrees) {
  const slider = byId('tilt');
  tell({roll: (degrees - Number(slider.dataset.at || 0)) * Math.PI / 180});
  slider.value = slider.dataset.at = String(degrees);
}

function useTool(next) {
  if (tool === 'crop') tell({box: false});
  if (tool === 'turn') {
    tell({roll: null});
    byId('tilt').value = byId('tilt').dataset.at = '0';
  }
  tool = next;
  box = null;
  byId('inside').textContent = '';
  for (const name of ['crop', 'turn']) {
    show(byId(`${name}-how`), tool === name);
    byId(name).setAttribute('aria-expanded', String(tool === name));
  }
  if (tool === 'crop') tell({box: true});
  if (tool) byId(`${tool}-how`).scrollIntoView({block: 'nearest'});
  offerEdits();
}

// What is on the stage is new: nothing of a tool is there any more.
function stageIsNew(told) {
  byId('tilt').value = byId('tilt').dataset.at = '0';
  tool = null;
  subject = told ? told.subject : null;
  useTool(null);
}

const inWorld = (place) => place.map((x, k) => x + input.splat.origin[k]);
const boxNumbers = () => [...inWorld(box.low), ...inWorld(box.high)];

let counting = 0;
async function countInside() {
  const mine = ++counting;
  const [step] = await input.splat.countEdits([{filterBox: boxNumbers()}]);
  if (mine === counting && box) byId('inside').textContent = `${number(step.left)} of ${number(input.splat.count)} Gaussians are inside.`;
}

// Edits.

const removed = ({taken, left}) => `${number(taken)} Gaussians removed, ${number(left)} left.`;

// Shows the splat with these edits; `said` is told once it is there. Nothing has changed if that fails.
async function showEdits(list, count, said) {
  const mine = session;
  const {original} = input;
  working = true;
  trouble(null);
  busy('Working…');
  offer();
  try {
    const made = count > 0 ? await original.edit(list.slice(0, count).map((edit) => edit.action))
      : {splat: original, actions: [], world: UNMOVED};
    const last = made.actions[count - 1];
    const drop = () => (made.splat === original ? null : made.splat.close());
    if (mine !== session) return await drop();
    if (count > counted && list !== edits && last.left === input.splat.count && !list[count - 1].moves) {
      await drop();
      byId('edited').textContent = `${list[count - 1].nothing} Nothing was removed.`;
      return useTool(null);
    }
    const info = count > 0 ? await made.splat.info() : input.originalInfo;
    const gained = await made.splat.filterGain(Number(byId('upscale').value));
    if (mine !== session) return await drop();
    const old = [result && result.splat, input.splat !== original && input.splat];
    const lostResult = result !== null;
    const from = {world, origin: input.splat.origin};
    Object.assign(input, {splat: made.splat, info});
    [edits, counted, world, result, gain] = [list, count, made.world, null, gained];
    byId('done').textContent = lostResult ? 'The splat has changed: enhance it again.' : '';
    byId('edited').textContent = said(last);
    if (cameras && isMoved()) {
      dropCameras();
      byId('cameras-about').textContent = 'The training cameras are closed, as they fit the splat where it was before.';
    }
    describe(input);
    tellPixelSize();
    for (const splat of old) if (splat) await splat.close();
    await showInput({change: (look) => lookAfter(look, from.world, from.origin, world, made.splat.origin)});
    document.documentElement.dataset.state = 'shown';
  } catch (error) {
    if (mine !== session) return;
    trouble(/leave nothing/.test(error.message) ? new Error('Nothing would be left of it. The splat is as it was.') : error);
  } finally {
    working = false;
    if (mine === session) busy('');
    offer();
  }
}

function addEdit(edit) {
  return showEdits([...edits.slice(0, counted), edit], counted + 1, (step) => edit.told(step));
}

const crop = (key) => addEdit({name: 'Crop', action: {[key]: boxNumbers()}, told: removed,
  nothing: key === 'filterBox' ? 'All of it is inside.' : 'The box is empty.'});

async function turnUpright() {
  const {up} = await lookOfStage();
  const usual = [0, -1, 0];
  if (dotOf(up, usual) > 1 - 1e-9) {
    byId('edited').textContent = 'It stands upright like this.';
    return useTool(null);
  }
  return addEdit({name: 'Turn upright', action: {up}, told: () => 'Turned upright.', moves: true});
}

function undo() {
  if (byId('undo').disabled) return;
  const {name} = edits[counted - 1];
  showEdits(edits, counted - 1, () => `Undone: ${name.toLowerCase()}. ${number(input.splat.count)} Gaussians.`);
}

function redo() {
  if (byId('redo').disabled) return;
  const edit = edits[counted];
  showEdits(edits, counted + 1, (step) => `Done again: ${edit.name.toLowerCase()}. ${edit.told(step)}`);
}

byId('crop').onclick = () => useTool(tool === 'crop' ? null : 'crop');
byId('turn').onclick = () => useTool(tool === 'turn' ? null : 'turn');
byId('crop-end').onclick = byId('turn-end').onclick = () => useTool(null);
byId('tilt').oninput = () => setTilt(Number(byId('tilt').value));
byId('keep').onclick = () => crop('filterBox');
byId('remove').onclick = () => crop('removeBox');
byId('upright').onclick = turnUpright;
byId('floaters').onclick = () => addEdit({name: 'Remove floaters', action: {filterFloaters: true}, told: removed,
  nothing: 'Nothing hangs in the air.'});
byId('centre').onclick = () => addEdit({name: 'Centre', action: {origin: inWorld(subject.target)},
  told: () => 'Its middle is at 0, 0, 0.', moves: true});
byId('undo').onclick = undo;
byId('redo').onclick = redo;

addEventListener('message', ({source, data}) => {
  if (source !== viewer.contentWindow || !data) return;
  if (data.undo) undo();
  if (data.redo) redo();
  if (!data.box || tool !== 'crop') return;
  box = data.box;
  offerEdits();
  if (box.done) countInside().catch(trouble);
});
addEventListener('keydown', (event) => {
  const key = event.key.toLowerCase();
  if (!(event.ctrlKey || event.metaKey) || !['z', 'y'].includes(key) || event.target.closest('input[type="text"], input[type="number"]')) return;
  event.preventDefault();
  if (key === 'y' || event.shiftKey) redo();
  else undo();
});
offerEdits();

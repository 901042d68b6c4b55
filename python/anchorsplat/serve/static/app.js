'use strict';
const $ = (id) => document.getElementById(id);
const KEY = 'anchorsplat-jobs';
const MOST_JOBS = 50;
let limits = null;
let endWatch = () => {};
let shown = null;  // id of the job in the card
let sending = false;

// The jobs of this browser: only their ids are kept here, what they are comes from the service.
function remembered() {
  try {
    const list = JSON.parse(localStorage.getItem(KEY) || '[]');
    return Array.isArray(list) ? list.filter((e) => e && typeof e.id === 'string') : [];
  } catch {
    return [];
  }
}
function remember(list) {
  try { localStorage.setItem(KEY, JSON.stringify(list.slice(0, MOST_JOBS))); } catch { /* private windows: until it closes */ }
}

function say(element, text) {
  element.textContent = text || '';
  element.hidden = !text;
}

function list(element, sentences) {
  element.replaceChildren(...sentences.map((sentence) => {
    const item = document.createElement('li');
    item.textContent = sentence;
    return item;
  }));
}

// The card.

function showJob(job) {
  if (job.id !== shown) return;
  $('job').hidden = false;
  $('job').dataset.state = job.state;
  $('job-name').textContent = job.name;
  $('job-facts').textContent = factsText(job);
  $('state').textContent = stateText(job);
  $('cancel').hidden = isOver(job);
  $('working').hidden = isOver(job);
  setBar(job.progress && job.progress.total > 0 ? job.progress.done / job.progress.total : null);
  say($('failed'), job.state === 'failed' ? job.error.message : '');
  $('result').hidden = job.state !== 'done';
  if (job.state === 'done') showResult(job);
  if (isOver(job)) showPast();
}

function setBar(share) {
  if (share === null) $('bar').removeAttribute('value');
  else $('bar').value = share;
}

function showResult(job) {
  list($('sentences'), job.report.sentences);
  list($('warnings'), job.report.warnings);
  $('warned').hidden = job.report.warnings.length === 0;
  const options = job.formats.map((format) => new Option(`.${format}${format === 'gltf' ? ' (zip)' : ''}`, format));
  if ($('format').dataset.job !== job.id) {
    $('format').replaceChildren(...options);
    $('format').dataset.job = job.id;
  }
  setDownload(job);
  $('format').onchange = () => setDownload(job);
  const view = job.links.view;
  $('open').hidden = $('viewer').hidden = !view;
  if (view && $('viewer').dataset.job !== job.id) {
    $('viewer').dataset.job = job.id;
    $('viewer').src = view;
    $('open').href = view;
  }
}

function setDownload(job) {
  $('download').href = `${job.links.result}?format=${encodeURIComponent($('format').value)}`;
}

function clearViewer() {
  const viewer = $('viewer');
  if (!viewer.dataset.job) return;
  const fresh = viewer.cloneNode();  // leaves nothing in the history
  fresh.removeAttribute('src');
  delete fresh.dataset.job;
  viewer.replaceWith(fresh);
}

function open(id) {
  endWatch();
  if (shown !== id) clearViewer();
  shown = id;
  if (id === null) {
    $('job').hidden = true;
    return;
  }
  endWatch = watchJob(id, showJob, () => {
    remember(remembered().filter((e) => e.id !== id));
    if (location.hash.slice(1) === id) history.replaceState(null, '', '/');
    open(null);
    showPast();
  });
}

const followHash = () => open(location.hash.slice(1) || null);

$('cancel').onclick = async () => {
  const response = await fetch(`/v1/jobs/${shown}`, {method: 'DELETE'});
  if (!response.ok) say($('failed'), await errorText(response));
};

// Those before.

async function showPast() {
  const entries = remembered();
  const jobs = await Promise.all(entries.map(async ({id}) => {
    const response = await fetch(`/v1/jobs/${encodeURIComponent(id)}`).catch(() => null);
    if (response && response.status === 404) return null;
    return response && response.ok ? response.json() : undefined;
  }));
  remember(entries.filter((_, k) => jobs[k] !== null));
  const known = jobs.filter((job) => job);
  $('past').hidden = known.length === 0;
  $('jobs').replaceChildren(...known.map(pastItem));
}

function pastItem(job) {
  const item = document.createElement('li');
  const link = document.createElement('a');
  link.href = `#${job.id}`;
  link.textContent = job.name;
  if (job.id === shown) link.setAttribute('aria-current', 'true');
  const facts = document.createElement('small');
  const when = new Date(job.created * 1000).toLocaleString([], {dateStyle: 'medium', timeStyle: 'short'});
  facts.textContent = `${job.state} · ${factsText(job)} · ${when}`;
  link.append(facts);
  const remove = document.createElement('button');
  remove.type = 'button';
  remove.textContent = '✕';
  remove.setAttribute('aria-label', `Delete ${job.name}`);
  remove.onclick = async () => {
    let response = await fetch(job.links.self, {method: 'DELETE'});
    if (response.status === 200) response = await fetch(job.links.self, {method: 'DELETE'});  // it was not over
    if (!response.ok && response.status !== 404) return;
    remember(remembered().filter((e) => e.id !== job.id));
    if (shown === job.id) {
      history.replaceState(null, '', '/');
      open(null);
    }
    showPast();
  };
  item.append(link, remove);
  return item;
}

// A new one.

function picked() {
  const file = $('file').files[0];
  $('picked').textContent = file ? file.name : 'Drop a splat here, or choose a file';
  if (file) $('picked-more').textContent = bytesText(file.size);
  const large = file && limits && file.size > limits.max_upload;
  say($('refused'), large ? `${file.name} has ${bytesText(file.size)}; this service takes ${bytesText(limits.max_upload)}.` : '');
  $('start').disabled = Boolean(sending || large);
}
$('file').onchange = picked;

for (const type of ['dragenter', 'dragover']) {
  addEventListener(type, (event) => {
    event.preventDefault();
    $('drop').classList.add('over');
  });
}
addEventListener('dragleave', (event) => { if (!event.relatedTarget) $('drop').classList.remove('over'); });
addEventListener('drop', (event) => {
  event.preventDefault();
  $('drop').classList.remove('over');
  if (sending || event.dataTransfer.files.length === 0) return;
  $('file').files = event.dataTransfer.files;
  picked();
  $('start').focus();
});

function formOf() {
  const form = new FormData();
  for (const name of ['quality', 'upscale']) form.append(name, $('form').elements[name].value);
  if ($('form').elements.mode.value) form.append('mode', $('form').elements.mode.value);
  const region = $('form').elements.region.value.replace(/\s+/g, '');
  if (region) form.append('region', region);
  if ($('form').elements.max_gaussians.value) form.append('max_gaussians', $('form').elements.max_gaussians.value);
  if ($('form').elements.clean.checked) form.append('clean', 'true');
  if ($('cameras').files[0]) form.append('cameras', $('cameras').files[0]);
  form.append('file', $('file').files[0]);
  return form;
}

$('form').onsubmit = async (event) => {
  event.preventDefault();
  const name = $('file').files[0].name;
  sending = true;
  $('start').disabled = true;
  say($('refused'), '');
  endWatch();
  clearViewer();
  shown = null;
  $('job').hidden = false;
  $('job').dataset.state = 'sending';
  $('job-name').textContent = name;
  $('job-facts').textContent = '';
  for (const id of ['result', 'cancel', 'failed']) $(id).hidden = true;
  $('working').hidden = false;
  $('job').scrollIntoView({block: 'nearest'});
  let answer;
  for (;;) {
    setBar(0);
    answer = await send('/v1/enhance', formOf(), (sent, all) => {
      setBar(sent < all ? sent / all : null);
      $('state').textContent = sent < all ? `Sending: ${bytesText(sent)} of ${bytesText(all)}.` : 'Looking at it…';
    });
    if (answer.status !== 429) break;
    $('state').textContent = 'Many are waiting. Trying again soon…';
    await new Promise((resolve) => setTimeout(resolve, 1000 * Math.max(1, answer.wait)));
  }
  sending = false;
  picked();
  if (answer.status !== 200 && answer.status !== 202) {
    $('job').hidden = true;
    const unheard = 'The connection ended before the file was there. Is the service running, and the file unchanged?';
    say($('refused'), answer.body && answer.body.error ? answer.body.error.message : answer.status ? `The service answered with ${answer.status}.` : unheard);
    return;
  }
  const job = answer.body;
  remember([{id: job.id}, ...remembered()]);
  history.pushState(null, '', `#${job.id}`);
  open(job.id);
  showJob(job);
  showPast();
};

addEventListener('beforeunload', (event) => { if (sending) event.preventDefault(); });
addEventListener('hashchange', () => { followHash(); showPast(); });

(async () => {
  followHash();
  showPast();
  const response = await fetch('/v1/limits').catch(() => null);
  if (!response || !response.ok) return;
  limits = await response.json();
  $('kept').textContent = `Results that nobody asks for are deleted after ${limits.keep_days} days.`;
  picked();
})();

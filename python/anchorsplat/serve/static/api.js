'use strict';
// Shows /openapi.json: each operation with its parameters, its answers and a line for the shell.

function element(name, text, className) {
  const made = document.createElement(name);
  if (text !== undefined) made.textContent = text;
  if (className) made.className = className;
  return made;
}

function typeText(schema) {
  if (schema.anyOf) return schema.anyOf.filter((s) => s.type !== 'null').map(typeText).join(' or ');
  if (schema.const !== undefined) return JSON.stringify(schema.const);
  if (schema.enum) return schema.enum.map((v) => JSON.stringify(v)).join(', ');
  const ends = [['minimum', '≥'], ['exclusiveMinimum', '>'], ['maximum', '≤'], ['exclusiveMaximum', '<']];
  return [schema.type, ...ends.filter(([key]) => key in schema).map(([key, sign]) => `${sign} ${schema[key]}`)].join(' ');
}

function table(heads, rows) {
  const wide = element('div', undefined, 'wide');
  const made = element('table');
  const head = made.createTHead().insertRow();
  for (const text of heads) head.append(element('th', text));
  const body = made.createTBody();
  for (const row of rows) {
    const line = body.insertRow();
    row.forEach((text, k) => line.append(k === 0 ? element('td') : element('td', text)));
    line.cells[0].append(element('code', row[0]));
  }
  wide.append(made);
  return wide;
}

function curl(method, path, operation) {
  const upload = operation.requestBody ? ' -F file=@scan.ply' : '';
  const verb = method === 'delete' ? ' -X DELETE' : '';
  return `curl${verb}${upload} ${location.origin}${path.replace('{job_id}', '$JOB')}`;
}

function operationCard(path, method, operation) {
  const card = element('section', undefined, 'card');
  const title = element('h2');
  title.append(element('span', method.toUpperCase(), 'method'), element('code', path));
  card.append(title, element('p', [operation.summary, operation.description].filter(Boolean).join('. ')));
  const rows = (operation.parameters || []).filter((p) => p.in === 'query').map((p) =>
    [p.name, typeText(p.schema), p.schema.default === undefined || p.schema.default === null ? '' : String(p.schema.default), p.description || p.schema.description || '']);
  const form = operation.requestBody && operation.requestBody.content['multipart/form-data'];
  for (const [name, schema] of Object.entries(form ? form.schema.properties : {})) {
    rows.unshift([name, 'file, of a form', '', schema.description || 'the splat; or send it as the body']);
  }
  if (rows.length) card.append(table(['option', 'values', 'default', 'what'], rows));
  card.append(table(['answer', 'when'], Object.entries(operation.responses).map(([status, r]) => [status, r.description])));
  card.append(element('pre', curl(method, path, operation)));
  return card;
}

(async () => {
  const place = document.getElementById('operations');
  const response = await fetch('/openapi.json').catch(() => null);
  if (!response || !response.ok) {
    place.append(element('p', 'The description could not be fetched. Please reload.', 'problem'));
    return;
  }
  const {paths} = await response.json();
  for (const [path, methods] of Object.entries(paths)) {
    for (const [method, operation] of Object.entries(methods)) place.append(operationCard(path, method, operation));
  }
})();

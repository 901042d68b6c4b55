// What the tests in JavaScript share: expectations that are counted, headless Chromium, tabs that are watched, a server of files.
import fs from 'node:fs';
import http from 'node:http';
import path from 'node:path';
import {createRequire} from 'node:module';

let passed = 0;
let failed = 0;
export function expect(name, condition, detail = '') {
  if (condition) return void ++passed;
  ++failed;
  console.log(`FAILED ${name} ${detail}`);
}

// Says how it went and ends the program; exit code 1 if an expectation was not met.
export function finish() {
  console.log(`${passed} passed, ${failed} failed`);
  process.exit(failed === 0 ? 0 : 1);
}

// $CHROMIUM, driven by the playwright-core in $NODE_FOLDER, with more `switches`. There need be no graphics card.
export function launchBrowser(switches = []) {
  const {chromium} = createRequire(path.join(process.env.NODE_FOLDER, 'package.json'))('playwright-core');
  return chromium.launch({
    executablePath: process.env.CHROMIUM || '/usr/bin/chromium',
    args: ['--use-gl=angle', '--use-angle=swiftshader', '--enable-unsafe-swiftshader', '--no-sandbox',
      '--disable-gpu-sandbox', '--disable-background-networking', '--disable-component-update', '--disable-sync',
      '--no-first-run', ...switches],
  });
}

// A new tab. What it says on its console (`hushed` is to be ignored), an error that nobody caught and that is not `known`,
// and a request to an address that `allowed` does not know are failures.
export async function watchedTab(context, {allowed, hushed = /^$/, console = true, known} = {}) {
  const tab = await context.newPage();
  tab.setDefaultTimeout(300000);  // a software renderer on a busy machine
  tab.on('console', (message) => {
    if (console && !hushed.test(message.text())) expect('a silent console', false, `${message.type()}: ${message.text()}`);
  });
  tab.on('pageerror', (error) => expect('no uncaught error', known?.test(error.message), error.message));
  tab.on('request', (request) => {
    if (allowed) expect('no request to the network', allowed.test(request.url()), request.url().slice(0, 100));
  });
  return tab;
}

const TYPES = {'.html': 'text/html', '.js': 'text/javascript', '.mjs': 'text/javascript', '.wasm': 'application/wasm'};

// Serves what `fileOf(path)` names, '' for nothing, with `headers`. Returns {home, close}: its address, and what ends it at once.
export async function serve(fileOf, headers = {}) {
  const server = http.createServer((request, response) => {
    const file = fileOf(new URL(request.url, 'http://x').pathname);
    if (!file || !fs.existsSync(file)) return response.writeHead(404).end();
    response.writeHead(200, {'content-type': TYPES[path.extname(file)] ?? 'application/octet-stream', ...headers})
      .end(fs.readFileSync(file));
  });
  await new Promise((resolve) => server.listen(0, '127.0.0.1', resolve));
  return {
    home: `http://127.0.0.1:${server.address().port}/`,
    close() {
      server.close();
      server.closeAllConnections();
    },
  };
}

// What a page must send for threads: it is isolated from other origins then.
export const ISOLATED = {
  'cross-origin-opener-policy': 'same-origin',
  'cross-origin-embedder-policy': 'require-corp',
};

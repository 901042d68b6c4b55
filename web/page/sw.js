'use strict';
// Keeps the page, so that it opens without a network; a newer one is fetched when there is one. With it the engine with
// threads, where the host isolates the page from other origins.
const KEPT = 'anchorsplat-{{version}}';
const THREADS = ['worker-threads.js', 'engine-threads.wasm'];
const nameOf = (url) => new URL(url).pathname.split('/').pop();
// The page itself, by the folder's address or by its name: other pages of this host are none of its business.
const isPage = (url) => [new URL('./', self.location), new URL('index.html', self.location)].some(({pathname}) => pathname === new URL(url).pathname);
self.addEventListener('install', (event) => {
  event.waitUntil(caches.open(KEPT).then(async (cache) => {
    await cache.add('./');
    if (self.crossOriginIsolated) await cache.addAll(THREADS).catch(() => {});  // the page does without
    await self.skipWaiting();
  }));
});
self.addEventListener('activate', (event) => {
  event.waitUntil(caches.keys()
    .then((names) => Promise.all(names.filter((name) => name.startsWith('anchorsplat-') && name !== KEPT).map((name) => caches.delete(name))))
    .then(() => self.clients.claim()));
});
self.addEventListener('fetch', (event) => {
  const name = event.request.mode === 'navigate' && isPage(event.request.url) ? './' : nameOf(event.request.url);
  if (name !== './' && !THREADS.includes(name)) return;
  event.respondWith(fetch(event.request).then(async (response) => {
    if (response.ok) await (await caches.open(KEPT)).put(name, response.clone());
    return response;
  }).catch(() => caches.match(name)));
});

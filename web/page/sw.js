'use strict';
// Keeps the one page that there is, so that it opens without a network; a newer one is fetched when there is one.
const KEPT = 'anchorsplat-{{version}}';
self.addEventListener('install', (event) => {
  event.waitUntil(caches.open(KEPT).then((cache) => cache.add('./')).then(() => self.skipWaiting()));
});
self.addEventListener('activate', (event) => {
  event.waitUntil(caches.keys()
    .then((names) => Promise.all(names.filter((name) => name !== KEPT).map((name) => caches.delete(name))))
    .then(() => self.clients.claim()));
});
self.addEventListener('fetch', (event) => {
  if (event.request.mode !== 'navigate') return;
  event.respondWith(fetch(event.request).then(async (response) => {
    if (response.ok) await (await caches.open(KEPT)).put('./', response.clone());
    return response;
  }).catch(() => caches.match('./')));
});

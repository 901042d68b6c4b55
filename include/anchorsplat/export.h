#pragma once

// What the shared library exports; everything else in it is hidden.
#define ANCHORSPLAT_PUBLIC __attribute__((visibility("default")))

#pragma once

// Marks exported symbols of the shared library; all others are hidden.
#define ANCHORSPLAT_PUBLIC __attribute__((visibility("default")))

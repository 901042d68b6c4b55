#pragma once

// The whole library.
#include <anchorsplat/compare.h>
#include <anchorsplat/enhance.h>
#include <anchorsplat/error.h>
#include <anchorsplat/files.h>
#include <anchorsplat/fit.h>
#include <anchorsplat/picture.h>
#include <anchorsplat/render.h>
#include <anchorsplat/run.h>
#include <anchorsplat/splat.h>

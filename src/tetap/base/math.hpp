// SPDX-License-Identifier: Apache-2.0
// The elementary functions in float: no libm, no double, the same bits on every target (see the files for method and
// error).
#pragma once

#include "tetap/base/arctangent.hpp"
#include "tetap/base/exp_log.hpp"
#include "tetap/base/float_bits.hpp"
#include "tetap/base/trig.hpp"

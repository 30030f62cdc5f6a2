// SPDX-License-Identifier: Apache-2.0
// The elementary functions in float: no libm, no double, the same bits on every target (see the files for method and
// error).
#pragma once

#include "base/arctangent.hpp"
#include "base/exp_log.hpp"
#include "base/float_bits.hpp"
#include "base/trig.hpp"

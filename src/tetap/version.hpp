// SPDX-License-Identifier: Apache-2.0
// Version of this tree, for #if. Before 1.0 the API is compatible within the same minor version; from 1.0 on, within
// the same major version. API are the headers that docs/reference/api.md names.
#pragma once

#define TETAP_VERSION_MAJOR 0
#define TETAP_VERSION_MINOR 1
#define TETAP_VERSION_PATCH 0

// SPDX-License-Identifier: Apache-2.0
// Unicorn 2.0.1 keeps QEMU's locks of pages for translating threads, which it does not have: at each store of the core
// it makes a tree of locked pages and deletes it. These two stand in front of its own; a
// version of the engine without them does not ask.

extern "C" {
void* page_collection_lock_arm(void* engine, unsigned long first, unsigned long last);
void page_collection_unlock_arm(void* pages);
}

void* page_collection_lock_arm(void* /*engine*/, unsigned long /*first*/, unsigned long /*last*/) {
  static int nothing = 0;
  return &nothing;
}

void page_collection_unlock_arm(void* /*pages*/) {}

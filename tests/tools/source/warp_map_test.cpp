#include "tools/source/warp_map.h"

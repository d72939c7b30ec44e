#include "tools/source/crs.h"

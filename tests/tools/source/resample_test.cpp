#include "tools/source/resample.h"

# Writes public headers for installation: includes of our own begin with scree/, so that no folder of a user's that is
# called common or runtime can take their place. cmake -D SOURCE=... -D OUTPUT=... -D HEADERS=a;b;c -P this
file(REMOVE_RECURSE ${OUTPUT})
foreach(header IN LISTS HEADERS)
    file(READ ${SOURCE}/${header} text)
    string(REGEX REPLACE "(#include )\"(common|runtime)/" "\\1\"scree/\\2/" text "${text}")
    # What C programs include is at the top.
    string(REGEX REPLACE "^common/c_api/" "" place ${header})
    file(WRITE ${OUTPUT}/${place} "${text}")
endforeach()

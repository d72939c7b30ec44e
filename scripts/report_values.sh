# Reads the JSON that the programs write, for scripts: sourced, not run. No more than bash and awk.

# report_value FILE PATH: the number or text at a path such as frame_ms.median; nothing where there is none. For files
# with one value a line and two spaces a level, as the programs write them.
report_value() {
    awk -v path="$2" '
        match($0, /^ *"[^"]*": /) {
            key = substr($0, 1, RLENGTH)
            value = substr($0, RLENGTH + 1)
            match(key, /^ */)
            depth = RLENGTH / 2
            gsub(/^ *"|": $/, "", key)
            place[depth] = depth > 1 ? place[depth - 1] "." key : key
            if (place[depth] != path || value ~ /^[\[{]/) next
            gsub(/^"|",?$|,$/, "", value)
            print value
            exit
        }' "$1"
}

# ratio_of A B: A / B; 0 where B is 0.
ratio_of() { awk -v a="${1:-0}" -v b="${2:-0}" 'BEGIN { if (b != 0) printf "%.6g", a / b; else print 0 }'; }

# megabytes BYTES
megabytes() { awk -v bytes="${1:-0}" 'BEGIN { printf "%.3f", bytes / 1e6 }'; }

# Waits for a line. Where it comes to the end of the file instead, whoever should have written it is
# gone: all processes with NAME=VALUE ($1) in their environment are killed, until none has come up
# for a while.
read -r line && exit
quiet=0
while [ $quiet -lt 4 ]; do
    quiet=$((quiet + 1))
    for one in $(grep -alzx -- "$1" /proc/[0-9]*/environ 2>/dev/null); do
        one=${one#/proc/}
        kill -9 "${one%/environ}" && quiet=0
    done
    sleep 0.05
done

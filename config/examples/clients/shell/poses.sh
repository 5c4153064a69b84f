#!/bin/sh
# Poses of a crepesd on this robot, one JSON object a line, for jq or grep; needs nc (netcat-openbsd).
#   poses.sh [ADDRESS [PORT [RATE_HZ]]] | jq 'select(.class == "POSE") | .position'
# Ends when its reader does.
address=${1:-127.0.0.1}
port=${2:-47475}
rate=${3:-10}

# The lease is ten seconds: a lost datagram does not matter.
ask() {
  while kill -0 $$ && printf '{"class":"WATCH","enable":true,"rate_hz":%s}' "$rate"; do sleep 1; done 2>/dev/null
}

# nc writes datagrams one after another without a separator: an object ends where the next begins.
# nc ignores the end of its reader. So the reader's end stops this shell, and that stops `ask`. The daemon falls
# silent when the lease has ended, and nc ends after some seconds of silence.
trap 'exit 0' TERM
ask | nc -u -w 5 "$address" "$port" | {
  perl -e '$/ = "}{"; $| = 1; while (<STDIN>) { chomp; print $. > 1 ? "{" : "", $_, "}\n" or exit }
           $. or warn "no answer from $ARGV[0] port $ARGV[1]\n"' "$address" "$port"
  kill $$
} &
wait

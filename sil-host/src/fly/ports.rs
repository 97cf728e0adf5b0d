//! MAVLink on UDP, to a station, and on TCP, for any number of them.

use std::io::{self, ErrorKind, Read, Write};
use std::net::{SocketAddr, TcpListener, TcpStream, UdpSocket};

use mavlink_vehicle::{Decoder, Line, Packet};

/// Bytes that a slow connection may owe; frames beyond are dropped whole.
const OWED_MAX: usize = 1 << 18;
/// Most stations on each of both protocols.
const STATIONS_MAX: usize = 16;

/// Addresses of the ports.
#[derive(Clone, Debug, Default)]
pub struct PortOptions {
    /// Addresses that datagrams are sent to from the start: stations that listen.
    pub udp: Vec<SocketAddr>,
    /// Address at which stations may connect.
    pub tcp: Option<SocketAddr>,
}

/// Open ports.
#[derive(Debug)]
pub struct Ports {
    udp: UdpSocket,
    peers: Vec<Peer>,
    listener: Option<TcpListener>,
    connections: Vec<Connection>,
}

/// A station that is reached by datagrams.
#[derive(Debug)]
struct Peer {
    address: SocketAddr,
    decoder: Decoder,
}

#[derive(Debug)]
struct Connection {
    stream: TcpStream,
    line: Line,
    decoder: Decoder,
    owed: Vec<u8>,
    closed: bool,
}

impl Ports {
    /// Opens the ports.
    ///
    /// # Errors
    /// When an address is in use or not of this machine.
    pub fn open(options: &PortOptions) -> io::Result<Self> {
        let any_v6 = options.udp.iter().any(SocketAddr::is_ipv6);
        let udp = UdpSocket::bind(if any_v6 { "[::]:0" } else { "0.0.0.0:0" })?;
        udp.set_nonblocking(true)?;
        let listener = match options.tcp {
            Some(address) => {
                let listener = TcpListener::bind(address).map_err(|error| {
                    io::Error::new(error.kind(), format!("TCP {address}: {error}"))
                })?;
                listener.set_nonblocking(true)?;
                Some(listener)
            }
            None => None,
        };
        let peers = options.udp.iter().map(|address| Peer::new(*address)).collect();
        Ok(Self { udp, peers, listener, connections: Vec::new() })
    }

    /// Address at which stations may connect, with the port that was chosen for port zero.
    #[must_use]
    pub fn tcp_address(&self) -> Option<SocketAddr> {
        self.listener.as_ref().and_then(|listener| listener.local_addr().ok())
    }

    /// Passes every packet that has come to `handle`, with the line that it came over.
    pub fn receive(&mut self, mut handle: impl FnMut(&Packet, Line)) {
        self.accept();
        let mut buffer = [0; 2048];
        // Bounded: a flood waits for the next turn.
        for _ in 0..512 {
            let Ok((count, from)) = self.udp.recv_from(&mut buffer) else { break };
            let bytes = buffer.get(..count).unwrap_or_default();
            if let Some(peer) = self.peer(from) {
                let line = line(from);
                let packets = bytes.iter().filter_map(|byte| peer.decoder.push(*byte));
                packets.for_each(|packet| handle(&packet, line));
            }
        }
        for connection in &mut self.connections {
            connection.receive(&mut buffer, &mut handle);
        }
        self.connections.retain(|connection| !connection.closed);
    }

    /// Sends a frame to every station.
    pub fn send(&mut self, frame: &[u8]) {
        for peer in &self.peers {
            // Nobody may be there: datagrams are sent in any case.
            let _ = self.udp.send_to(frame, peer.address);
        }
        for connection in &mut self.connections {
            if connection.owed.len() + frame.len() <= OWED_MAX {
                connection.owed.extend_from_slice(frame);
            }
        }
    }

    /// Hands what is owed to the connections, as far as they take it.
    pub fn flush(&mut self) {
        self.connections.iter_mut().for_each(Connection::flush);
        self.connections.retain(|connection| !connection.closed);
    }

    fn accept(&mut self) {
        let Some(listener) = &self.listener else { return };
        while let Ok((stream, from)) = listener.accept() {
            let ready = stream.set_nonblocking(true).and_then(|()| stream.set_nodelay(true));
            if ready.is_ok() && self.connections.len() < STATIONS_MAX {
                let (line, decoder, owed) = (line(from), Decoder::new(), Vec::new());
                self.connections.push(Connection { stream, line, decoder, owed, closed: false });
            }
        }
    }

    /// The station behind an address; a new one is answered from now on.
    fn peer(&mut self, address: SocketAddr) -> Option<&mut Peer> {
        let known = self.peers.iter().position(|peer| peer.address == address);
        match known {
            Some(index) => self.peers.get_mut(index),
            None if self.peers.len() < STATIONS_MAX => {
                self.peers.push(Peer::new(address));
                self.peers.last_mut()
            }
            None => None,
        }
    }
}

/// The line to a station: nobody else reads the loopback interface.
fn line(station: SocketAddr) -> Line {
    if station.ip().to_canonical().is_loopback() { Line::Secure } else { Line::Open }
}

impl Peer {
    fn new(address: SocketAddr) -> Self {
        Self { address, decoder: Decoder::new() }
    }
}

impl Connection {
    fn receive(&mut self, buffer: &mut [u8], handle: &mut impl FnMut(&Packet, Line)) {
        for _ in 0..64 {
            match self.stream.read(buffer) {
                Ok(0) => return self.closed = true,
                Ok(count) => {
                    let bytes = buffer.get(..count).unwrap_or_default();
                    let packets = bytes.iter().filter_map(|byte| self.decoder.push(*byte));
                    packets.for_each(|packet| handle(&packet, self.line));
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => return,
                Err(error) if error.kind() == ErrorKind::Interrupted => {}
                Err(_) => return self.closed = true,
            }
        }
    }

    fn flush(&mut self) {
        self.closed |= !write_owed(&mut self.stream, &mut self.owed);
    }
}

/// Writes as much of what is owed as the stream takes now; `false` if it is closed.
pub(super) fn write_owed(stream: &mut TcpStream, owed: &mut Vec<u8>) -> bool {
    while !owed.is_empty() {
        match stream.write(owed) {
            Ok(0) => return false,
            Ok(count) => {
                owed.drain(..count);
            }
            Err(error) if error.kind() == ErrorKind::WouldBlock => return true,
            Err(error) if error.kind() == ErrorKind::Interrupted => {}
            Err(_) => return false,
        }
    }
    true
}
